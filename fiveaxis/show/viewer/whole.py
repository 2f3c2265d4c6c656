"""A program as it is, of all operations, to be shown with its own lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import Finding, IntArray
from fiveaxis.check import Standing, Surroundings
from fiveaxis.model import Energy, Machine, Motion, Steadiness, TiltBounds, Tool, Toolpath
from fiveaxis.nc import trace_tool
from fiveaxis.show.viewer.moves import MOST_ROWS, Side, thinned

# Stands for a cutter that isn't known, mm.
UNKNOWN = Tool.ball(6.0)


@dataclass(frozen=True, eq=False)
class ShownOperation:
    """An operation of a program, as it is shown.

    Parameters
    ----------
    motion : its moves, in the control's time
    energy : what they cost
    name : number or name of its tool in the program; empty if none is stated
    tool : its cutter; None where it isn't known
    findings : with the lines of the program; locations are rows of the motion, if those are of the same line
    """

    motion: Motion
    energy: Energy
    name: str
    tool: Tool | None
    findings: tuple[Finding, ...] = ()

    def placed(self, finding: Finding, begin: int) -> Finding:
        """Return a finding at the row, from `begin`, of its location or else of its line."""
        at, line = finding.place.location, finding.place.line
        rows = self.motion.source
        if at is None or at >= len(rows) or (line is not None and rows[at] != line):
            found = np.flatnonzero(rows == line)
            at = int(found[0]) if len(found) else None
        return replace(finding, place=replace(finding.place, location=None if at is None else at + begin))


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
    findings : of its verification; locations are rows of `toolpath`
    surroundings : part, stock and fixtures
    standing : how the part stands over an assumed table
    assumed : sentences on what nobody states, and on what isn't shown
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    side: Side
    lines: tuple[str, ...]
    tools: tuple[Tool | None, ...]
    findings: tuple[Finding, ...]
    surroundings: Surroundings
    standing: Standing | None
    assumed: tuple[str, ...]

    def __repr__(self) -> str:
        operations = f"{len(self.tools)} operation{'s' * (len(self.tools) != 1)}"
        found = f"{len(self.findings)} findings, {len(self.assumed)} assumptions"
        return (
            f"<WholeProgram {Path(self.toolpath.name).name}: {operations}, {self.side.time:,.1f} s; {found}>"
        )

    @classmethod
    def of(
        cls,
        name: str,
        machine: Machine,
        lines: Sequence[str],
        parts: Sequence[ShownOperation],
        surroundings: Surroundings,
        standing: Standing | None,
        assumed: tuple[str, ...],
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
            part.placed(finding, int(at))
            for part, at in zip(parts, first, strict=False)
            for finding in part.findings
        )
        tools = tuple(part.tool for part in parts)
        unknown = dict.fromkeys(part.name for part in parts if part.tool is None)
        if unknown:
            named = ", ".join(filter(None, unknown))
            which, how = (f"tool {named}", "1=ball:10") if named else ("the tool", "ball:10")
            assumed += (
                f"{which} is drawn as {UNKNOWN} and checked against nothing, as no comment states the "
                f"cutter; name it (--tool {how})",
            )
        shown = thinned(side, MOST_ROWS)
        return cls(machine, path, tilt, shown, tuple(lines), tools, findings, surroundings, standing, assumed)
