"""What a page shows: a solution with what stands around it, or a program as it is with its own lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import CadFile, Finding, IntArray, MeshSource, SettingError
from fiveaxis.cam import Mesh, load_mesh
from fiveaxis.check import CutStock, Standing, Surroundings
from fiveaxis.model import Energy, Machine, Motion, Steadiness, TiltBounds, Tool, Toolpath
from fiveaxis.nc import Source, trace_tool
from fiveaxis.posture import Optimum
from fiveaxis.show.viewer.moves import (
    MOST_ROWS,
    NO_LINE,
    ShownProgram,
    Side,
    Stop,
    choose_sides,
    find_stops,
    thinned,
    whole_result,
)

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


@dataclass(frozen=True, kw_only=True, eq=False)
class Beside:
    """All that `preview` and `write_preview` take as keywords: what is shown beside a solution."""

    program: ShownProgram | None = None
    part: MeshSource | None = None
    surroundings: Surroundings | None = None
    findings: Sequence[Finding] = ()
    cad: CadFile = CadFile()


@dataclass(frozen=True, eq=False, kw_only=True)
class Shown:
    """What a page shows.

    Parameters
    ----------
    machine : whose axes move
    toolpath, tilt : of the result, with the bounds on its tool axis
    sides : the motions, the result first
    lines : of the program's text, where its moves tell them
    tools : that move, None where one isn't known
    findings : of verification; locations are rows of `toolpath`
    part : in place of that of the surroundings
    surroundings : part, stock and fixtures
    standing : how the part stands over an assumed table
    cutting : the result where it cuts a stock, with all its rows: a chord may pass through what they avoid
    cut : the stock as verification has cut it
    assumed : sentences on what nobody states, and on what isn't shown
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    sides: tuple[Side, ...]
    lines: tuple[str, ...] = ()
    tools: tuple[Tool | None, ...]
    findings: Sequence[Finding] = ()
    part: Mesh | None = None
    surroundings: Surroundings = field(default_factory=Surroundings)
    standing: Standing | None = None
    cutting: Side | None = None
    cut: CutStock | None = None
    assumed: tuple[str, ...] = ()

    @cached_property
    def stops(self) -> list[Stop]:
        """Where errors and warnings of the result begin."""
        return find_stops(self.findings, self.sides[0])

    @property
    def marked(self) -> Sequence[Finding]:
        """The findings that have marks."""
        return self.findings


def shown_of(solution: Optimum | Shown, given: Beside) -> Shown:
    """Collect what is shown of a solution, or of a program as it is, which has its own surroundings.

    `MeshError` for a part that can't be read; `SettingError` for what is neither.
    """
    if isinstance(solution, Optimum):
        shown = _with_program(solution, given)
    elif isinstance(solution, Shown):
        shown = solution
    else:
        raise SettingError(
            f"a preview shows a solution, and this is {solution!r:.80}; show a program by "
            "preview(show_program(FILE, MACHINE))"
        )
    part, cad = shown.surroundings.part if given.part is None else given.part, given.cad
    if isinstance(part, str | Path):
        part = load_mesh(part, allow_open=True, mesh_tolerance=cad.mesh_tolerance, body=cad.body)
    return replace(shown, part=None if part is None else Mesh.of(part))


def _with_program(solution: Optimum, given: Beside) -> Shown:
    program, sides = given.program, choose_sides(solution, given.program)
    around = given.surroundings or Surroundings()
    shown = Shown(
        machine=solution.machine,
        toolpath=solution.toolpath,
        tilt=solution.tilt,
        sides=sides,
        tools=(solution.toolpath.tool,),
        findings=given.findings,
        surroundings=around,
        cutting=None if around.blank is None else whole_result(solution, program),
    )
    if program is None:
        return shown
    lines = program.text.lines if (sides[0].line != NO_LINE).any() else ()
    return replace(shown, lines=lines, standing=program.report.standing, cut=program.report.cut)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WholeProgram(Shown):
    """The moves of all operations of a program as it is, one after the other; nothing is cut."""

    @property
    def side(self) -> Side:
        """The moves, with their lines in the file."""
        return self.sides[0]

    @property
    def marked(self) -> Sequence[Finding]:
        """Where each run of findings begins: every block may have a fault."""
        return [stop.finding for stop in self.stops]

    def __repr__(self) -> str:
        operations = f"{len(self.tools)} operation{'s' * (len(self.tools) != 1)}"
        found = f"{len(self.findings)} findings, {len(self.assumed)} assumptions"
        return (
            f"<WholeProgram {Path(self.toolpath.name).name}: {operations}, {self.side.time:,.1f} s; {found}>"
        )

    @classmethod
    def of(
        cls,
        source: Source,
        machine: Machine,
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
        path = trace_tool(motion, machine, next((p.tool for p in parts if p.tool), UNKNOWN), source.name)
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
        return cls(
            machine=machine,
            toolpath=path,
            tilt=tilt,
            sides=(thinned(side, MOST_ROWS),),
            lines=tuple(source.lines),
            tools=tools,
            findings=findings,
            surroundings=surroundings,
            standing=standing,
            assumed=assumed,
        )
