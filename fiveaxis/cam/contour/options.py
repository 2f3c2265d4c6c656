"""The options of `plan_contour`, checked, and what they select."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    Bounds,
    MeshSource,
    PlanContour,
    SettingError,
    Unit,
    options_of,
    product,
)
from fiveaxis.cam.contour.leaning import Leaning
from fiveaxis.cam.mesh.cad.choice import LEAST_OVERHANG
from fiveaxis.cam.mesh.loading import take_mesh
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.model import Constraints, Tool

# Least angle between a wall's normal and that of the section planes; on flatter faces the passes would be too
# far apart. Faces within the same angle of straight down lie on the table.
FLATTEST_WALL = np.radians(10.0)
LOWEST = -float(np.cos(FLATTEST_WALL))
# mm, default distance of the sections.
STEP = 1.0
# A strip's radius at its contact is that at this share of the ridge's height.
AT_CONTACT = 0.01
# Finest step and spacing, as a share of the part's extent.
FINEST_SHARE = 1e-5
# Options that a strategy doesn't have.
FOREIGN = {
    "waterline": ("stepover", "raster_angle", "flow_along"),
    "raster": ("stepdown", "flow_along", "spiral"),
    "flow": ("stepdown", "raster_angle"),
}
# Contact points of a plan: more take hours, and are mostly a wrong unit.
MOST_CONTACTS = 3e6


@dataclass(frozen=True, kw_only=True)
class PlanOptions(PlanContour):
    """The options of `plan_contour`, in the same units.

    Parameters
    ----------
    unit : of the part's file
    progress : called with the sections or lines done and their number

    Raises
    ------
    SettingError
        An option out of range, an unknown word, options that exclude each other.
    """

    unit: Unit | None = None
    progress: Callable[[int, int], None] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in FOREIGN[self.strategy]:
            value, unit = getattr(self, name), options_of(PlanContour)[name][1].unit
            if value is None or value is False:
                continue
            said = f"{value:g} {unit}" if unit else str(value).lower()
            own = " or ".join(repr(word) for word in FOREIGN if name not in FOREIGN[word])
            other = "stepover" if name == "stepdown" else f"strategy = {own} with it, or leave it out"
            raise SettingError(f"{name} = {said} is no option of the {self.strategy} strategy; give {other}")

    def mesh(self, part: MeshSource, name: str = "mesh") -> Mesh:
        """Read or check a part, as `take_mesh` does."""
        return take_mesh(
            part,
            name=name,
            unit=self.unit,
            allow_open=self.allow_open,
            mesh_tolerance=self.mesh_tolerance,
            body=self.body,
        )

    @property
    def step(self) -> float | None:
        """Largest distance of neighbouring sections or lines, mm; None where only the scallop limits it."""
        step = self.stepdown if self.strategy == "waterline" else self.stepover
        return STEP if step is None and self.scallop is None else step

    @property
    def frame(self) -> Array:
        """(3, 3), rows: axes of the section frame in the workpiece frame; the last is the sections' normal.

        A raster's passes run along the first, at ``raster_angle`` from x towards y.
        """
        if self.strategy == "waterline":
            return np.eye(3)
        angle = np.radians(self.raster_angle or 0.0)
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        plane = np.array([-along[1], along[0], 0.0])
        return np.array([along, np.cross(plane, along), plane])

    def is_wall(self, normals: Array) -> BoolArray:
        """Check which normals, (n, 3) unit vectors in the workpiece frame, belong to what is cut, (n,)."""
        if self.strategy != "flow":
            near = np.abs(product(normals, self.frame[2])) <= np.cos(FLATTEST_WALL)
            wall = near & (normals[:, 2] >= LOWEST)
        else:
            # A face that is named is cut wherever it is.
            wall = normals[:, 2] >= (LOWEST if self.faces is None else -np.inf)
        return wall & (normals[:, 2] <= -np.sin(LEAST_OVERHANG)) if self.overhang else wall

    @property
    def backward(self) -> bool:
        """Whether passes run against the sections' direction, which has the material to its right.

        A waterline climbs with the wall to its right. A raster engages the strip that the next passes cut; as
        its sections are cut in descending order along their normal, that strip lies to their left. Lines of
        flow have it to their right.
        """
        return (self.direction == "conventional") != (self.strategy == "raster")

    def leaning(self, tool: Tool) -> Leaning:
        """Find how a tool may touch; `ToolError` as `Leaning.of`.

        Raises
        ------
        SettingError
            A scallop too high for the strip that the tool cuts, or options for balls only.
        """
        found = Leaning.of(tool, Constraints.of(Bounds.of(self)))
        if found.turns_in_place:
            if self.scallop is not None and self.scallop >= found.ball:
                raise SettingError(
                    f"scallop = {self.scallop:g} mm must be less than the ball's radius, {found.ball:g} mm"
                )
            return found
        if self.lead_in or self.lead_out:
            raise SettingError(
                f"lead_in and lead_out are arcs of a ball's centre, and {tool} is no ball; leave them out"
            )
        strip = self.strip_radius(found)
        if self.scallop is not None and strip <= self.scallop:
            step = "stepdown" if self.strategy == "waterline" else "stepover"
            raise SettingError(
                f"scallop = {self.scallop:g} mm: within the bounds on its lean {tool} can cut a strip of "
                f"radius {round(strip, 3):g} mm, as it does when it leans across the feed; bound lead and "
                f"lean (--lead 5:15 --lean -2:2), or give {step} in place of the scallop"
            )
        return found

    def strip_radius(self, leaning: Leaning) -> float:
        """Return the smallest radius at the contact, mm, of the strips that a tool cuts on a flat surface."""
        height = AT_CONTACT * (self.scallop or 1.0)
        return float(leaning.strip_radius(height, np.zeros(1))[0])

    def check_size(self, extent: float, area: float, radius: float) -> None:
        """Refuse steps so small for the part's extent, mm, and area, mm², that no plan ends.

        The radius, mm, is that of the strips.
        """
        finest = extent * FINEST_SHARE
        for name in ("stepdown", "stepover", "spacing"):
            value = getattr(self, name)
            if value is not None and value < finest:
                raise SettingError(
                    f"{name} = {value:g} mm is below {finest:g} mm, the finest for a part of "
                    f"{extent:g} mm; give more, or check the part's unit"
                )
        if self.scallop is not None:
            # Between sections, on the flattest wall.
            step = 2.0 * math.sqrt(2.0 * radius * self.scallop) * math.sin(FLATTEST_WALL)
            if step < finest:
                raise SettingError(
                    f"scallop = {self.scallop:g} mm needs steps of {step:.2g} mm, and {finest:g} mm is the "
                    f"finest for a part of {extent:g} mm; give more, or check the part's unit"
                )
        steps = self.stepdown, self.stepover, 2.0 * math.sqrt(2.0 * radius * (self.scallop or 0.0)) or None
        count = area / (self.spacing * min((step for step in steps if step is not None), default=1.0))
        if count > MOST_CONTACTS:
            raise SettingError(
                f"the plan would have about {count:.1g} contact points, more than {MOST_CONTACTS:.1g}: the "
                f"part is {extent:.4g} mm long; check its unit (--unit), or give larger steps and spacing"
            )
