"""The scene as text that a page carries: meshcat's commands, packed."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from fiveaxis.viewer.layout import Layout
from fiveaxis.viewer.scene import ROOT, Scene

# Figures of the show are told with so many digits.
DIGITS = 6


class Recorder:
    """Stands in for meshcat's window: keeps the commands, so that no server process is needed."""

    def __init__(self) -> None:
        self.commands: list[bytes] = []

    def send(self, command: Any) -> None:
        """Keep a command as the bytes that a browser would get."""
        self.commands.append(import_module("umsgpack").packb(command.lower()))


def pack_payload(commands: Sequence[bytes], head: dict[str, Any]) -> str:
    """Pack a scene: gzip, then base64, the same text each time.

    Parameters
    ----------
    commands : as meshcat packs them
    head : what else the page's script has to know; the lengths of the commands are put beside it

    Returns
    -------
    Of four bytes with the length of the head (little-endian), the head as JSON, and all commands.
    """
    told = json.dumps(head | {"lengths": [len(c) for c in commands]}, separators=(",", ":")).encode()
    content = len(told).to_bytes(4, "little") + told + b"".join(commands)
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")


def describe_show(scene: Scene) -> dict[str, Any]:
    """Say what the page's script has to know: arrangement, copies, and what is shown when."""
    frames = scene.sides[0].frames
    return {
        "root": f"/meshcat/{ROOT}",
        "layout": _arrangement(scene.layout),
        "machine_layout": _arrangement(scene.layout.with_machine()),
        "copies": scene.copies,
        "duration": max(_round(side.frames.times[-1]) for side in scene.sides),
        "pace": _round(frames.pace),
        "times": [_round(time) for time in frames.times],
        "rows": frames.rows.tolist(),
    }


def _arrangement(layout: Layout) -> dict[str, list[float]]:
    return {
        "together": _matrix(layout.together()),
        "apart": _matrix(layout.apart()),
        "shift": _matrix(layout.shift()),
    }


def _matrix(transform: Any) -> list[float]:
    """Give a transform column by column, as three.js reads it."""
    return [float(x) for x in transform.T.reshape(-1)]


def _round(value: float) -> float:
    return float(f"{float(value):.{DIGITS}g}")
