"""The data of the page: the scene as meshcat's commands, the moves as arrays of numbers, packed to text."""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array
from fiveaxis.model import Machine, Motion, link_poses
from fiveaxis.show.viewer.moves import Side, read_off
from fiveaxis.show.viewer.scene import STAGE, Scene
from fiveaxis.show.viewer.shown import Shown

# Steps of a number that is packed in 16 bit.
STEPS = 2**16 - 1
# Of gzip: above it numbers take four times as long, and no fewer bytes.
LEVEL = 6
# viridis at 0, 1/8 … 1 (van der Walt and Smith, CC0): perceptually even, safe for the colour-blind.
VIRIDIS = np.array(
    [
        [0.267, 0.005, 0.329],
        [0.278, 0.175, 0.483],
        [0.230, 0.322, 0.546],
        [0.173, 0.449, 0.558],
        [0.128, 0.567, 0.551],
        [0.158, 0.684, 0.502],
        [0.369, 0.789, 0.383],
        [0.678, 0.864, 0.190],
        [0.993, 0.906, 0.144],
    ]
)
# Quantile of all powers at which the scale ends, so that one reversal doesn't darken the rest.
CLIPPED_AT = 0.98
# It also ends at this multiple of this quantile of the result's powers, because of costly baselines.
USUAL, MULTIPLE = 0.9, 3.0


class Sections:
    """Named arrays of numbers, one after the other."""

    def __init__(self) -> None:
        self.index: dict[str, dict[str, Any]] = {}
        self.content: list[bytes] = []

    def add(self, name: str, values: NDArray[Any], kind: str) -> None:
        """Add an array, row by row, as little-endian numbers of numpy's kinds f8, f4, i4 or u1."""
        self._add(name, np.ascontiguousarray(values, dtype=f"<{kind}"), {"kind": kind})

    def add_steps(self, name: str, values: Array) -> None:
        """Add an array of finite numbers as shares of the largest, in 16 bit."""
        top = float(np.max(np.abs(values), initial=0.0)) or 1.0
        steps = np.round(np.abs(values) / top * STEPS).astype("<u2")
        self._add(name, steps, {"kind": "u2", "unit": top / STEPS})

    def _add(self, name: str, packed: Any, meaning: dict[str, Any]) -> None:
        self.index[name] = meaning | {"size": int(packed.nbytes)}
        self.content.append(packed.tobytes())


def pack_payload(commands: Sequence[bytes], sections: Sections, head: Mapping[str, Any]) -> str:
    """Pack a scene by gzip and base64, always to the same text.

    Returns
    -------
    Four bytes with the length of the head (little-endian), the head as JSON, all commands, all arrays
    """
    whole = dict(head) | {"commands": [len(c) for c in commands], "sections": sections.index}
    text = json.dumps(whole, separators=(",", ":")).encode()
    content = len(text).to_bytes(4, "little") + text + b"".join(commands) + b"".join(sections.content)
    return base64.b64encode(gzip.compress(content, LEVEL, mtime=0)).decode("ascii")


def describe_show(shown: Shown, scene: Scene) -> tuple[dict[str, Any], Sections]:
    """Collect the data for the page's script."""
    sections, sides = Sections(), shown.sides
    readings = [read_off(side, shown.machine) for side in sides]
    powers = [cutting_powers(r["powers"], s.motion) for r, s in zip(readings, sides, strict=True)]
    head = {
        "stage": f"/meshcat/{STAGE}",
        "machine": _machine(shown.machine),
        "extents": {
            name: {"middle": _numbers(extent.middle), "size": extent.size}
            for name, extent in scene.extents.items()
        },
        "sides": [side.name for side in sides],
        "top": colour_top(*powers),
        "scale": VIRIDIS.tolist(),
        "tilt": [math.degrees(shown.tilt.low), math.degrees(shown.tilt.high)],
        "text": list(shown.lines),
        "stops": [stop.as_list() for stop in shown.stops],
    }
    for number, (side, reading) in enumerate(zip(sides, readings, strict=True)):
        _add_side(sections, str(number), side, reading)
    return head, sections


def _machine(machine: Machine) -> dict[str, Any]:
    """Describe the chain: joints from workpiece to tool, their links, and the axes in the columns' order."""
    letters = [joint.letter for joint in machine.chain.joints]
    return {
        "joints": [
            {
                "letter": joint.letter,
                "column": machine.column(joint.letter),
                "rotary": joint.is_rotary,
                "direction": list(joint.line.direction),
                "point": list(joint.line.point),
            }
            for joint in machine.chain.joints
        ],
        "links": list(link_poses(machine, np.zeros((1, len(letters))))),
        "tool_home": _matrix(machine.chain.tool_home),
        "frame": _matrix(machine.setup.frame),
        "axes": [
            {
                "letter": axis.letter,
                "rotary": axis.is_rotary,
                "sign": -1 if axis.reversed is True else 1,
                "low": _end(axis.limits.low, axis.is_rotary),
                "high": _end(axis.limits.high, axis.is_rotary),
                "powered": axis.drive is not None,
            }
            for axis in machine.axes
        ],
    }


def _add_side(sections: Sections, name: str, side: Side, reading: Mapping[str, Array]) -> None:
    sections.add(f"{name}/clock", side.clock - side.clock[0], "f8")
    sections.add(f"{name}/positions", side.motion.positions, "f4")
    sections.add(f"{name}/place", side.place, "f4")
    sections.add(f"{name}/points", reading["points"], "f4")
    sections.add(f"{name}/lean", reading["lean"], "f4")
    sections.add(f"{name}/line", side.line, "i4")
    if side.tool is not None:
        sections.add(f"{name}/tool", side.tool, "i4")
    sections.add(f"{name}/cutting", side.motion.cutting, "i4")
    events = side.steadiness
    sections.add(f"{name}/events", np.column_stack([events.time, events.column, events.reverses]), "f4")
    for what in ("powers", "programmed", "actual"):
        sections.add_steps(f"{name}/{what}", np.nan_to_num(reading[what]))


def _end(value: float, is_rotary: bool) -> float | None:
    if not math.isfinite(value):
        return None
    return math.degrees(value) if is_rotary else value


def _matrix(transform: Array) -> list[float]:
    """Flatten a transform column by column, as three.js reads it."""
    return _numbers(transform.T.reshape(-1))


def _numbers(values: Array) -> list[float]:
    return [float(x) for x in values]


def cutting_powers(powers: Array, motion: Motion) -> Array:
    """Add up the power of all feed drives, (m, k) W, in each cut.

    Returns
    -------
    (m,), W, of the move that ends at the row; NaN for the first row, links, rapids and moves without duration
    """
    power = powers.sum(axis=1)
    known = motion.cutting & (motion.time > 0.0)
    known[:1] = False
    return np.where(known, power, np.nan)


def colour_top(result: Array, *others: Array) -> float:
    """Choose the power at the end of the scale, W, by those of the result and its baselines, (n,) each.

    It is positive even if all powers are 0; NaN is ignored.
    """
    together = np.concatenate([result, *others])
    known = together[np.isfinite(together)]
    usual = result[np.isfinite(result)]
    if not known.size or not known.max() > 0.0:
        return 1.0
    highest = float(np.quantile(known, CLIPPED_AT)) or float(known.max())
    bound = MULTIPLE * float(np.quantile(usual, USUAL)) if usual.size else 0.0
    return min(highest, bound) if bound > 0.0 else highest
