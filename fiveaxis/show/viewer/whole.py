"""A program as it is, of all operations, to be shown with its own lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.base import Finding, IntArray
from fiveaxis.model import Energy, Machine, Motion, Steadiness, TiltBounds, Tool, Toolpath
from fiveaxis.nc import trace_tool
from fiveaxis.show.viewer.moves import MOST_ROWS, Side, thinned

# Stands for a cutter that isn't known, mm.
UNKNOWN = Tool.ball(6.0)


@dataclass(frozen=True, eq=False)
class ShownOperation:
    """An operation of a program: its moves in the control's time, what they cost, cutter and findings."""

    motion: Motion
    energy: Energy
    tool: Tool | None
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class WholeProgram:
    """The moves of all operations of a program, one after the other.

    Parameters
    ----------
    machine : whose axes move
    toolpath : of the tip
    tilt : no bound
    side : the moves, with their lines in the file
    lines : of the file
    tools : of each operation, None where it isn't known
    findings : at the rows of `side`
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    side: Side
    lines: tuple[str, ...]
    tools: tuple[Tool | None, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(
        cls, name: str, machine: Machine, lines: Sequence[str], parts: Sequence[ShownOperation]
    ) -> WholeProgram:
        """Put operations together; where one ends and the next begins, no move is known."""
        counts = [len(part.motion) for part in parts]
        first, begins = np.cumsum([0, *counts]), np.cumsum([0.0, *(p.motion.time.sum() for p in parts)])
        names = ("positions", "feed", "time", "kind", "source")
        arrays: dict[str, Any] = {n: np.concatenate([getattr(p.motion, n) for p in parts]) for n in names}
        motion = Motion(machine.letters, **arrays)
        events = [part.energy.steadiness for part in parts]
        steadiness = Steadiness(
            machine.letters,
            np.concatenate([e.block + at for e, at in zip(events, first, strict=False)]),
            np.concatenate([e.column for e in events]),
            np.concatenate([e.reverses for e in events]),
            np.concatenate([e.time + at for e, at in zip(events, begins, strict=False)]),
            {},
        )
        path = trace_tool(motion, machine, next((p.tool for p in parts if p.tool), UNKNOWN), name)
        tilt = TiltBounds(np.full((len(motion), 3), np.nan), 0.0, math.pi, "programmed axis")
        energy, time = (sum(getattr(p.energy, what) for p in parts) for what in ("total", "time"))
        place = np.arange(len(motion), dtype=float)
        tool: IntArray = np.repeat(np.arange(len(parts)), counts)
        side = Side("program", motion, path, tilt, place, energy, time, steadiness, motion.source, tool)
        findings = tuple(
            replace(f, place=replace(f.place, location=f.place.location + int(at)))
            if f.place.location is not None
            else f
            for p, at in zip(parts, first, strict=False)
            for f in p.findings
        )
        tools = tuple(part.tool for part in parts)
        return cls(machine, path, tilt, thinned(side, MOST_ROWS), tuple(lines), tools, findings)
