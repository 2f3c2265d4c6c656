"""Sinumerik 840D cycles: drilling cycles as moves, CYCLE800 as a swivelled plane.

After *SINUMERIK 840D/840Di/810D Programming Guide Cycles* (Siemens 6FC5298-6AB40-0BP2), 2.1 drilling cycles
and 3.14 CYCLE800. Chip breaking, spindle orientation and dwells in revolutions don't change the path;
depth, planes and the order of moves do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.nc.languages.block import BlockError, Hole, Plane
from fiveaxis.nc.languages.planes import AXES, turns

# Argument of a call: a number, a text, or None if empty.
Value = float | str | None


@dataclass(frozen=True)
class HoleKind:
    """How a drilling cycle differs from plunging at feed and retracting in rapid.

    Parameters
    ----------
    dwell : argument index of the dwell; None if there is none
    back : G0 or G1, how the tool leaves the hole
    feeds : argument indices of the feeds down and back, for cycles with their own feeds
    thread : argument indices of pitch and spindle speed, for tapping cycles
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
    # NX posts boring without drag as CYCLE76; Siemens' CYCLE76 mills a spigot, and has a width.
    "CYCLE76": HoleKind(),
}
_SPIGOT_WIDTH = 6


def split_arguments(code: str, start: int) -> tuple[list[str], int]:
    """Split a block's arguments, from the opening bracket at `start` to the closing one, at their commas.

    The index after the closing bracket is returned, too.
    """
    parts, begin, end, depth, quoted = [], start + 1, start, 0, False
    for end in range(start, len(code)):
        sign = code[end]
        if sign == '"':
            quoted = not quoted
        elif not quoted:
            depth += (sign == "(") - (sign == ")")
            if depth == 0:
                break
            if sign == "," and depth == 1:
                parts.append(code[begin:end])
                begin = end + 1
    if depth:
        raise BlockError("a bracket isn't closed")
    parts.append(code[begin:end])
    return [part.strip() for part in parts], end + 1


def read_hole(name: str, values: Sequence[Value]) -> Hole:
    """Read a call of a drilling cycle: ``CYCLE8n(RTP, RFP, SDIS, DP, DPR, …)``.

    `BlockError` if planes or depth are missing, or the depth is above the start.
    """
    kind = HOLES[name]
    if name == "CYCLE76" and _number(values, _SPIGOT_WIDTH) is not None:
        raise BlockError("CYCLE76 mills a spigot, which isn't expanded; post its moves")
    if name == "CYCLE81" and (_number(values, 6) or 0.0) >= 10.0:
        raise BlockError("CYCLE81 to a countersink diameter isn't supported; give the depth")
    back, reference = _number(values, 0), _number(values, 1)
    depth, relative = _number(values, 3), _number(values, 4)
    if reference is not None and relative:
        depth = reference - abs(relative)
    if back is None or reference is None or depth is None:
        raise BlockError(f"{name} needs RTP, RFP, and DP or DPR; write them")
    near = reference + (_number(values, 2) or 0.0)
    if depth > near:
        raise BlockError(f"{name} begins at {near:g} and ends at {depth:g}, above it; correct the depth")
    down, out = (0.0, 0.0) if kind.feeds is None else (_number(values, i) or 0.0 for i in kind.feeds)
    if kind.thread is not None:
        down = out = abs((_number(values, kind.thread[0]) or 0.0) * (_number(values, kind.thread[1]) or 0.0))
    dwell = 0.0 if kind.dwell is None else _number(values, kind.dwell) or 0.0
    doubts = _doubts(name, back, reference, threaded=down > 0.0)
    return Hole(name, back, near, depth, dwell, down, out, kind.back, doubts)


def _doubts(name: str, back: float, reference: float, *, threaded: bool) -> tuple[tuple[str, str], ...]:
    doubts = (
        (
            back < reference,
            "cycle-retracts-below",
            f"{name} retracts to {back:g}, below its reference plane {reference:g}; check RTP, which is "
            "relative to the program zero",
        ),
        (
            name in ("CYCLE84", "CYCLE840") and not threaded,
            "tap-feed-assumed",
            f"{name} gives no pitch and speed; F is taken as the tapping feed; check it",
        ),
        (
            name == "CYCLE76",
            "cycle-as-hole",
            "CYCLE76 without a width is taken as boring, as NX posts it; check it",
        ),
    )
    return tuple((code, message) for applies, code, message in doubts if applies)


@dataclass(frozen=True)
class Swivel:
    """A CYCLE800 call.

    Parameters
    ----------
    plane : the swivelled plane
    additive : whether it is relative to the plane in force
    positions : whether the control turns the rotary axes into it
    follows : whether the control holds the tip meanwhile
    """

    plane: Plane
    additive: bool
    positions: bool
    follows: bool


# Bits 7 and 6 of the swivel mode.
_AXIS_BY_AXIS, _MODES = 0, ("axis by axis", "solid angle", "projection angle", "rotary axes direct")


def read_swivel(values: Sequence[Value]) -> Swivel | None:
    """Read ``CYCLE800(_FR, _TC, _ST, _MODE, _X0, _Y0, _Z0, _A, _B, _C, _X1, _Y1, _Z1, _DIR, …)``.

    The plane is shifted by _X0 _Y0 _Z0, rotated by three angles about the axes that _MODE names, each axis
    of the frame rotated so far, and then shifted by _X1 _Y1 _Z1. None if the call switches the swivelled
    plane off; `BlockError` for an unsupported mode: its meaning depends on the machine.
    """
    given = [v for v in values if v not in (None, "")]
    if not given or (len(values) > 1 and values[1] == "0"):
        return None
    mode = int(_number(values, 3) or 0.0)
    if mode >> 6 != _AXIS_BY_AXIS:
        kind = _MODES[mode >> 6] if 0 < mode < 256 else "unknown"
        raise BlockError(f"CYCLE800 in mode {mode} ({kind}) isn't supported; post it axis by axis (mode 57)")
    order = [mode & 3, mode >> 2 & 3, mode >> 4 & 3]
    angles = [_number(values, i) or 0.0 for i in (7, 8, 9)]
    if any(angle and not axis for angle, axis in zip(angles, order, strict=True)):
        raise BlockError(f"CYCLE800 in mode {mode} names no axis for one of its angles; correct the mode")
    axes = "".join(AXES[axis - 1] if axis else "X" for axis in order)
    before, after = (
        np.array([_number(values, i) or 0.0 for i in part]) for part in ((4, 5, 6), (10, 11, 12))
    )
    plane = Plane(before).then(Plane(rotation=turns(axes, angles))).then(Plane(after))
    status = int(_number(values, 2) or 0.0)
    follows = status // 10 % 10 == 1 and not _number(values, 0)
    return Swivel(plane, status % 10 == 1, _number(values, 13) != 0.0, follows)


def _number(values: Sequence[Value], index: int) -> float | None:
    value = values[index] if index < len(values) else None
    if isinstance(value, str):
        raise BlockError(f"{value[:20]!r} where a number is expected; correct the call")
    return value
