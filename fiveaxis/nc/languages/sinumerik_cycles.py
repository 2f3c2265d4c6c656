"""Cycles of Sinumerik 840D that become moves or planes: drilling, and the swivelled plane of CYCLE800.

After *SINUMERIK 840D/840Di/810D Programming Guide Cycles* (Siemens 6FC5298-6AB40-0BP2), 2.1 drilling cycles
and 3.14 CYCLE800. Chip breaking, orientation of the spindle and dwell in revolutions aren't moves of a path;
the depth, the planes and the order of the moves are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.nc.languages.planes import AXES, Plane, turns

# A value of a call in brackets: a number, a text, or nothing between two commas.
Value = float | str | None


class CycleError(ValueError):
    """A call that isn't read; the message names the fact, and the caller knows file and line."""


@dataclass(frozen=True)
class HoleKind:
    """How a drilling cycle differs from going down at feed and back in rapid.

    Parameters
    ----------
    dwell : place of the dwell among the call's values; None if it has none
    back : how the tool leaves the hole
    feeds : places of the feeds down and back, for cycles that have their own
    thread : places of lead and spindle speed, for cycles that cut one
    """

    dwell: int | None = None
    back: str = "G0"
    feeds: tuple[int, int] | None = None
    thread: tuple[int, int] | None = None


HOLES = {
    "CYCLE81": HoleKind(),
    "CYCLE82": HoleKind(dwell=5),
    "CYCLE83": HoleKind(dwell=8),
    "CYCLE84": HoleKind(dwell=5, back="G1", thread=(8, 10)),
    "CYCLE840": HoleKind(dwell=5, back="G1"),
    "CYCLE85": HoleKind(dwell=5, back="G1", feeds=(6, 7)),
    "CYCLE86": HoleKind(dwell=5),
    "CYCLE87": HoleKind(),
    "CYCLE88": HoleKind(dwell=5),
    "CYCLE89": HoleKind(dwell=5, back="G1"),
    # As NX posts it for boring without drag; Siemens mills a spigot by this name, but with a width.
    "CYCLE76": HoleKind(),
}
_SPIGOT_WIDTH = 6


@dataclass(frozen=True)
class Hole:
    """A drilling cycle with its planes, in the program's unit along the tool's axis.

    Parameters
    ----------
    name : of the cycle
    back, near, depth : where the tool goes between holes, where feed begins, and where it ends
    dwell : s at the bottom
    feed_down, feed_back : of the cycle's own, 0 for the feed in force
    out : how the tool leaves the hole, G0 or G1
    doubts : what the call leaves open, by code
    """

    name: str
    back: float
    near: float
    depth: float
    dwell: float
    feed_down: float
    feed_back: float
    out: str
    doubts: tuple[tuple[str, str], ...]

    def moves(self, letter: str) -> list[tuple[str, dict[str, float]]]:
        """List its moves as a G word and the words beside it, for the tool along an axis."""
        down = {letter: self.depth} | ({"F": self.feed_down} if self.feed_down else {})
        out = {letter: self.back}
        if self.out == "G1" and self.feed_back:
            out["F"] = self.feed_back
        moves = [("G0", {letter: self.near}), ("G1", down)]
        if self.dwell > 0.0:
            moves.append(("G4", {"P": self.dwell}))
        return [*moves, (self.out, out)]


def read_hole(name: str, values: Sequence[Value]) -> Hole:
    """Read a call of a drilling cycle: ``CYCLE8n(RTP, RFP, SDIS, DP, DPR, …)``.

    Raises
    ------
    CycleError
        Planes or depth are missing, or a depth that isn't one.
    """
    kind = HOLES[name]
    if name == "CYCLE76" and _number(values, _SPIGOT_WIDTH) is not None:
        raise CycleError("CYCLE76 mills a spigot, which isn't expanded; let the CAM system write its moves")
    if name == "CYCLE81" and (_number(values, 6) or 0.0) >= 10.0:
        raise CycleError("CYCLE81 down to a diameter isn't read; give the depth")
    back, reference = _number(values, 0), _number(values, 1)
    depth, relative = _number(values, 3), _number(values, 4)
    if reference is not None and relative:
        depth = reference - abs(relative)
    if back is None or reference is None or depth is None:
        raise CycleError(f"{name} needs its planes and its depth: RTP, RFP, SDIS, DP or DPR")
    near = reference + (_number(values, 2) or 0.0)
    if depth > near:
        raise CycleError(
            f"{name} begins at {near:g} and ends at {depth:g}, above it; correct RFP, SDIS or DP"
        )
    down, out = (0.0, 0.0) if kind.feeds is None else (_number(values, i) or 0.0 for i in kind.feeds)
    if kind.thread is not None:
        down = out = abs((_number(values, kind.thread[0]) or 0.0) * (_number(values, kind.thread[1]) or 0.0))
    dwell = 0.0 if kind.dwell is None else _number(values, kind.dwell) or 0.0
    doubts = _doubts(name, back, reference, threaded=down > 0.0)
    return Hole(name, back, near, depth, dwell, down, out, kind.back, doubts)


def _doubts(name: str, back: float, reference: float, *, threaded: bool) -> tuple[tuple[str, str], ...]:
    doubts = []
    if back < reference:
        doubts.append(
            (
                "cycle-retracts-below",
                f"{name} retracts to {back:g}, below its reference plane {reference:g}, and is read so; "
                "RTP counts from the program's zero",
            )
        )
    if name in ("CYCLE84", "CYCLE840") and not threaded:
        doubts.append(
            ("tap-feed-assumed", f"{name} doesn't tell lead times speed; F is taken for the feed of the tap")
        )
    if name == "CYCLE76":
        doubts.append(
            (
                "cycle-as-hole",
                "CYCLE76 without a width is no spigot; it is read as a bored hole, as NX posts it",
            )
        )
    return tuple(doubts)


@dataclass(frozen=True)
class Swivel:
    """What CYCLE800 asks for.

    Parameters
    ----------
    plane : the swivelled plane
    additive : whether it counts in the plane in force
    positions : whether the control turns the rotary axes into it
    follows : whether it keeps the tool's tip where it is meanwhile
    """

    plane: Plane
    additive: bool
    positions: bool
    follows: bool


# Bits 7 and 6 of the swivel mode.
_AXIS_BY_AXIS, _MODES = 0, ("axis by axis", "solid angle", "projection angle", "rotary axes direct")


def read_swivel(values: Sequence[Value]) -> Swivel | None:
    """Read ``CYCLE800(_FR, _TC, _ST, _MODE, _X0, _Y0, _Z0, _A, _B, _C, _X1, _Y1, _Z1, _DIR, …)``.

    The plane is shifted by _X0 _Y0 _Z0, turned by three angles about the axes that _MODE names, each as those
    before have turned it, and then shifted by _X1 _Y1 _Z1.

    Returns
    -------
    None where the call switches the swivelled plane off.

    Raises
    ------
    CycleError
        A mode that isn't read, because it depends on the machine.
    """
    given = [v for v in values if v not in (None, "")]
    if not given or (len(values) > 1 and values[1] == "0"):
        return None
    mode = int(_number(values, 3) or 0.0)
    if mode >> 6 != _AXIS_BY_AXIS:
        kind = _MODES[mode >> 6] if 0 < mode < 256 else "unknown"
        raise CycleError(
            f"CYCLE800 in mode {mode} ({kind}) isn't read; post it axis by axis, as mode 57 or 27"
        )
    order = [mode & 3, mode >> 2 & 3, mode >> 4 & 3]
    angles = [_number(values, i) or 0.0 for i in (7, 8, 9)]
    if any(angle and not axis for angle, axis in zip(angles, order, strict=True)):
        raise CycleError(f"CYCLE800 in mode {mode} names no axis for one of its angles; correct the mode")
    axes = "".join(AXES[axis - 1] if axis else "X" for axis in order)
    before, after = (
        np.array([_number(values, i) or 0.0 for i in part]) for part in ((4, 5, 6), (10, 11, 12))
    )
    plane = Plane(before).then(Plane(rotation=turns(axes, angles))).then(Plane(after))
    status = int(_number(values, 2) or 0.0)
    follows = status // 10 % 10 == 1 and not _number(values, 0)
    return Swivel(plane, status % 10 == 1, _number(values, 13) != 0.0, follows)


def _number(values: Sequence[Value], place: int) -> float | None:
    value = values[place] if place < len(values) else None
    if isinstance(value, str):
        raise CycleError(f"{value[:20]!r} stands where a number belongs; correct the call")
    return value
