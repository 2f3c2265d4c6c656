"""The options of `plan_contour`, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from fiveaxis.contour.walls import FLATTEST_WALL
from fiveaxis.errors import SettingError, ToolError
from fiveaxis.geometry import Array
from fiveaxis.mesh.surface import SHARP_EDGE, require_crease
from fiveaxis.toolpath import Tool

Strategy = Literal["waterline", "raster"]
Direction = Literal["climb", "conventional", "zigzag"]
Order = Literal["levels", "islands"]
# Units of the options that must be above 0 if given.
UNITS = {
    "stepdown": "mm", "stepover": "mm", "scallop": "mm", "spacing": "mm", "feed_mm_min": "mm/min",
    "clearance": "mm",
}  # fmt: skip
# Options that may be 0, for none.
MAY_BE_ZERO = ("lead_in", "lead_out", "min_length")
CHOICES = {"strategy": Strategy, "direction": Direction, "order": Order}
# mm, default distance of the sections.
STEP = 1.0
# deg, default angle of facets that meet at an edge of the part.
CREASE = math.degrees(SHARP_EDGE)
# Finest step and spacing, as a share of the part's extent.
FINEST_SHARE = 1e-5


@dataclass(frozen=True)
class PlanOptions:
    """The numbers and words among the arguments of `plan_contour`, in the same units.

    Raises
    ------
    SettingError
        An option out of range, an unknown word, options that exclude each other.
    """

    strategy: Strategy = "waterline"
    stepdown: float | None = None
    stepover: float | None = None
    scallop: float | None = None
    raster_angle: float | None = None
    spacing: float = 0.5
    overhang: bool = False
    spiral: bool = False
    direction: Direction = "climb"
    order: Order = "levels"
    lead_in: float = 0.0
    lead_out: float = 0.0
    min_length: float = 0.0
    feed_mm_min: float = 1000.0
    clearance: float = 5.0
    crease: float = CREASE

    def __post_init__(self) -> None:
        require_crease(self.crease)
        for name, unit in UNITS.items():
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise SettingError(f"{name} = {value:g} {unit} is out of range; give more than 0 {unit}")
        for name in MAY_BE_ZERO:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SettingError(f"{name} = {value:g} mm is out of range; give 0 mm or more")
        if self.raster_angle is not None and not math.isfinite(self.raster_angle):
            raise SettingError(f"raster_angle = {self.raster_angle:g} deg is no angle; give a finite number")
        for name, words in CHOICES.items():
            if getattr(self, name) not in get_args(words):
                known = " or ".join(repr(word) for word in get_args(words))
                raise SettingError(f"{name} = {getattr(self, name)!r} is unknown; give {known}")
        self._check_strategy()

    def _check_strategy(self) -> None:
        raster = self.strategy == "raster"
        foreign = ("stepdown",) if raster else ("stepover", "raster_angle")
        for name in foreign:
            if getattr(self, name) is not None:
                other = "stepover" if raster else "strategy = 'raster' or leave it out"
                unit = UNITS.get(name, "deg")
                raise SettingError(
                    f"{name} = {getattr(self, name):g} {unit} is no option of the {self.strategy} strategy; "
                    f"give {other}"
                )
        if raster and self.spiral:
            raise SettingError("spiral joins closed waterlines; give strategy = 'waterline' with it")

    @property
    def step(self) -> float | None:
        """Largest distance of neighbouring sections, mm; None where only the scallop limits it."""
        step = self.stepover if self.strategy == "raster" else self.stepdown
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

    @property
    def backward(self) -> bool:
        """Whether passes run against the sections' direction, which has the material to its right.

        A waterline climbs with the wall to its right. A raster engages the strip that the next passes cut; as
        its sections are cut in descending order along their normal, that strip lies to their left.
        """
        return (self.direction == "conventional") != (self.strategy == "raster")

    def check_tool(self, tool: Tool) -> None:
        """Refuse cutters that aren't balls, and scallops too high for the ball."""
        if not tool.cutter.is_ball:
            raise ToolError(f"tool {tool}: passes are planned for balls only; give for example ball:10")
        if self.scallop is not None and self.scallop >= tool.radius:
            raise SettingError(
                f"scallop = {self.scallop:g} mm must be less than the ball's radius, {tool.radius:g} mm"
            )

    def check_size(self, extent: float, radius: float) -> None:
        """Refuse steps so small, compared with the part's extent in mm, that they would fill the memory."""
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
