"""Constraints on the tool's posture: one record, from the input to verification."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.base import Array, Bounds, Place, SettingError, ToolpathError, angle_between, keywords_of
from fiveaxis.model.toolpath.bounds import (
    Range,
    TiltBounds,
    cutting_speed_bounds,
    lead_lean_bounds,
    require_common_tilt,
    require_lead_lean,
    tilt_of,
)
from fiveaxis.model.toolpath.path import SHORTEST_DIRECTION, Toolpath

# Tolerance on a tool axis in a plane, which the search needs.
PLANE_TOLERANCE = math.radians(0.5)
# deg: a narrower singular cone isn't advised.
NARROWEST = 1.0


@dataclass(frozen=True)
class Constraints:
    """Bounds on postures and turns, rad; None or empty means unbounded.

    Parameters
    ----------
    tilt : smallest and largest angle between tool axis and surface normal
    cone : largest angle between tool axis and programmed axis; not together with `tilt`
    lead, lean : smallest and largest angle by which the tool is tipped in the feed direction, and to its left
        (`fiveaxis.model.toolpath.bounds`); alone or with the others
    plane : (3,), workpiece frame, normal vector of a plane that the tool axis stays in within
        `PLANE_TOLERANCE`; with one of the others
    hold : angles at which rotary axes are held, by letter
    max_turn : largest turn of a rotary axis in one cutting move
    turn_rate : rad/mm, largest turn of a rotary axis per length of the contact's path in cuts
    singular_cone : half angle about the direction of the first rotary axis within which a cut turns that axis
        by at most `singular_rate`
    singular_rate : rad/mm
    least_cutting_speed : mm/s, lowest speed of the cutting edge at the contact; beside a bound on angles
    spindle_speed : rad/s, at which it is
    """

    tilt: Range | None = None
    cone: float | None = None
    lead: Range | None = None
    lean: Range | None = None
    plane: tuple[float, float, float] | None = None
    hold: Mapping[str, float] = field(default_factory=dict)
    max_turn: float | None = None
    turn_rate: float | None = None
    singular_cone: float | None = None
    singular_rate: float = 0.0
    least_cutting_speed: float | None = None
    spindle_speed: float | None = None

    @classmethod
    @keywords_of(Bounds)
    def of_degrees(cls, bounds: Bounds) -> Constraints:
        """Make the record of bounds in degrees and deg/mm, as `of` does."""
        return cls.of(bounds)

    @classmethod
    def of(cls, bounds: Bounds) -> Constraints:
        """Convert bounds in degrees and deg/mm.

        Raises
        ------
        SettingError
            Both `tilt` and `cone`; a range that is empty, reversed or outside 0…180° (lead and lean:
            −90…90°); a tilt that no lead and lean give; a zero plane vector; a bound on turns that isn't
            positive; a singular rate without its cone, a least cutting speed without the spindle's.
        """
        if bounds.tilt is not None and bounds.cone is not None:
            raise SettingError(EITHER)
        if bounds.tilt is not None:
            require_range(*bounds.tilt)
        for name, ends in (("lead", bounds.lead), ("lean", bounds.lean)):
            if ends is not None:
                require_lead_lean(name, *ends)
        if bounds.tilt is not None:
            require_common_tilt(bounds.tilt, _radians_of(bounds.lead), _radians_of(bounds.lean))
        across = None if bounds.plane is None else np.asarray(bounds.plane, dtype=float)
        if across is not None and (
            across.shape != (3,) or not np.linalg.norm(across, axis=-1) > SHORTEST_DIRECTION
        ):
            raise SettingError(
                f"plane is {tuple(across.tolist())}; give the three components of a vector at right angles "
                "to the plane, not all 0"
            )
        if bounds.singular_cone is None and bounds.singular_rate:
            raise SettingError(
                f"singular_rate {bounds.singular_rate:g} deg/mm belongs to a singular cone; set "
                "singular_cone too"
            )
        cutting, spindle = bounds.least_cutting_speed, bounds.spindle_speed
        if cutting is not None and spindle is None:
            raise SettingError(
                f"least_cutting_speed {cutting:g} m/min needs the speed of the spindle; give spindle_speed "
                "(--spindle-speed 8000), in rev/min"
            )
        return cls(
            tilt=_radians_of(bounds.tilt),
            cone=_radians(bounds.cone),
            lead=_radians_of(bounds.lead),
            lean=_radians_of(bounds.lean),
            plane=None if across is None else (float(across[0]), float(across[1]), float(across[2])),
            hold={letter: math.radians(angle) for letter, angle in (bounds.hold or {}).items()},
            max_turn=_radians(bounds.max_turn),
            turn_rate=_radians(bounds.turn_rate),
            singular_cone=_radians(bounds.singular_cone),
            singular_rate=math.radians(bounds.singular_rate),
            least_cutting_speed=None if cutting is None else 1000.0 * cutting / 60.0,
            spindle_speed=None if spindle is None else 2.0 * math.pi * spindle / 60.0,
        )

    @property
    def bounds_lean(self) -> bool:
        """Whether anything bounds the tool's lean."""
        return self.bounds_angle or self.plane is not None or self.least_cutting_speed is not None

    @property
    def bounds_angle(self) -> bool:
        """Whether anything bounds the angle between the tool and the surface, or the programmed axis."""
        return any(bound is not None for bound in (self.tilt, self.cone, self.lead, self.lean))

    @property
    def least_radius(self) -> float:
        """Distance from the tool's axis at which its edge has the least cutting speed, mm; 0 without one."""
        if self.least_cutting_speed is None or self.spindle_speed is None:
            return 0.0
        return self.least_cutting_speed / self.spindle_speed

    @property
    def angles(self) -> Range | None:
        """Range of the angle between axis and normal, as `tilt`, or `lead` and `lean`, bound it."""
        if self.tilt is not None or (self.lead is None and self.lean is None):
            return self.tilt
        return tilt_of(self.lead, self.lean)

    @property
    def of_lean(self) -> Constraints:
        """The bounds on the tool's lean only."""
        return replace(self, hold={}, max_turn=None, turn_rate=None, singular_cone=None, singular_rate=0.0)

    def lean_bounds(self, toolpath: Toolpath) -> TiltBounds:
        """Return the bounds on the tool's lean along a path; they all hold at once.

        They hold where a cut begins or ends; within links and rapid moves the lean is free.

        Parameters
        ----------
        toolpath : with normals for tilt, lead and lean, with tool axes for a cone; in the zone that these
            bounds need (`zoned`)

        Raises
        ------
        SettingError
            Neither an angle nor a cone is bounded.
        ToolpathError
            The path lacks the direction that a bound refers to.
        ToolError
            No single zone of the cutter's profile touches over the range.
        """
        low, high = self._range(toolpath)
        beside = lead_lean_bounds(toolpath, self.lead, self.lean)
        if self.least_cutting_speed is not None and self.spindle_speed is not None:
            bound = cutting_speed_bounds(toolpath, self.least_cutting_speed, self.spindle_speed)
            if self.cone is None and high <= bound.low:
                raise SettingError(
                    f"at a least cutting speed of {60e-3 * self.least_cutting_speed:g} m/min {toolpath.tool} "
                    f"touches at {math.degrees(bound.low):.4g} deg to the normal or more; the range ends at "
                    f"{math.degrees(high):g} deg; widen it (--tilt), or raise the spindle's speed"
                )
            beside = (*beside, bound)
        zone = toolpath.zone
        if self.cone is not None:
            if zone.offset != 0.0 or len(toolpath.tool.cutter.zones) > 1:
                beside = (TiltBounds(toolpath.normal, zone.least, zone.high, "normal"), *beside)
            bounds = TiltBounds(toolpath.axis, low, high, "programmed axis", beside)
        elif self.tilt is not None:
            bounds = TiltBounds(toolpath.normal, low, high, "normal", beside)
        else:
            # The lean is bounded by lead and lean, the angle to the normal only by the zone.
            bounds = TiltBounds(toolpath.normal, zone.least, zone.high, "normal", beside)
        bounds = bounds if self.plane is None else _in_plane(bounds, self.plane)
        return bounds.only(toolpath.bounding)

    def zoned(self, toolpath: Toolpath) -> Toolpath:
        """Return a path with the zone of the cutter's profile that touches within these bounds.

        For a tilt range, or the one implied by lead and lean, it is the zone that touches over the whole
        range; for a cone, the one that touches at the programmed axes. The path is unchanged where nothing
        bounds that angle.

        Raises
        ------
        ToolpathError, ToolError
            As `lean_bounds`.
        """
        if not self.bounds_angle:
            return toolpath
        low, high = self._range(toolpath)
        cutter = toolpath.tool.cutter
        if self.cone is None:
            return toolpath.in_zone(cutter.zone_for(low, high))
        if cutter.zones[0].offset == 0.0 and len(cutter.zones) == 1:
            return toolpath
        cuts = toolpath.cutting
        if not toolpath.has_normals:
            raise ToolpathError(
                f"has no surface normals, and {toolpath.tool} has to be moved about its contact as it leans; "
                "say which surface it cuts (part, --part)",
                file=toolpath.name,
            )
        angle = angle_between(toolpath.axis[cuts], toolpath.normal[cuts])
        return toolpath.in_zone(cutter.zone_for(float(angle.min()), float(angle.max())))

    def _range(self, toolpath: Toolpath) -> Range:
        """Return the range of the angle to the first bound's reference, which the path must have."""
        if not self.bounds_angle:
            raise SettingError(EITHER)
        if self.cone is not None:
            if not toolpath.has_axes:
                raise ToolpathError(
                    "has no programmed tool axes, so a cone means nothing; use tilt (--tilt 15:75), the "
                    "angle to the surface normal",
                    file=toolpath.name,
                )
            return 0.0, self.cone
        if not toolpath.has_normals:
            raise ToolpathError(
                "has no surface normals, so a tilt range means nothing; use cone (--cone 20), the angle "
                "about the programmed tool axis",
                file=toolpath.name,
            )
        return self.angles or tilt_of(None, None)


EITHER = (
    "give either tilt (angle to the surface normal, --tilt 15:75) or cone (angle to the programmed axis, "
    "--cone 20)"
)


def require_range(low: float, high: float, name: str = "tilt") -> None:
    """Raise `SettingError` for a range of angles, deg, that is empty, reversed or outside 0…180°."""
    if not 0.0 <= low < high <= 180.0:
        raise SettingError(
            f"{name} range {low:g}…{high:g} deg is empty, reversed or outside 0…180 deg; "
            "write the smaller angle first, for example 15:75"
        )


def _radians(angle: float | None) -> float | None:
    return None if angle is None else math.radians(angle)


def _radians_of(ends: Range | None) -> Range | None:
    return None if ends is None else (math.radians(ends[0]), math.radians(ends[1]))


def _in_plane(bounds: TiltBounds, plane: tuple[float, float, float]) -> TiltBounds:
    """Add the bound that keeps the tool axis in a plane, given by its normal vector."""
    across = np.array(plane)
    bound = np.isfinite(bounds.reference).all(axis=1, keepdims=True)
    reference = np.where(bound, across / np.linalg.norm(across, axis=-1), np.nan)
    square = math.pi / 2.0
    low, high = square - PLANE_TOLERANCE, square + PLANE_TOLERANCE
    name = "plane's vector {:g} {:g} {:g}".format(*across)
    return replace(bounds, beside=(*bounds.beside, TiltBounds(reference, low, high, name)))


def singular_turn(
    letter: str, turns: Array, nearest: Array, last: Place, *, cone: float, rate: float = 0.0
) -> str:
    """Say that the cuts of a pass turn the first rotary axis within its singular cone, and what to do.

    Parameters
    ----------
    letter : of the axis
    turns : (m,), rad, in each of these cuts
    nearest : (m,), rad, the smallest angle to the singular direction in each
    last : of them
    cone, rate : rad and rad/mm, that were asked for
    """
    count = "1 cut" if len(turns) == 1 else f"{len(turns)} cuts"
    near = math.degrees(nearest.min())
    bound = f"{math.degrees(cone):g} deg" + (f", {math.degrees(rate):g} deg/mm" if rate else "")
    narrower = math.floor(10.0 * near) / 10.0
    # A narrower cone helps where the path keeps off the singular direction.
    remedy = f", or narrow the cone to {narrower:g} deg (--singular-cone)" if narrower >= NARROWEST else ""
    return (
        f"{letter} turns by {math.degrees(turns.sum()):.1f} deg in {count} of a pass, at most "
        f"{math.degrees(turns.max()):.3g} deg in one and the last at {replace(last, file=None)}, while the "
        f"tool axis is as near as {near:.2f} deg to the singular direction (cone {bound}): the path doesn't "
        f"hold it, so the control slows down; widen the tilt range or tilt the part on the table{remedy}"
    )
