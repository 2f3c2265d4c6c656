"""A program, or the table of a motion, read as the motion of the axes and the path of the tool's tip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, Reading, SettingError, Severity, options_of
from fiveaxis.model import (
    Machine,
    Motion,
    MoveKind,
    Tool,
    Toolpath,
    axis_positions,
    block_times,
    feed_times,
    nearest_turn,
    tool_poses,
)
from fiveaxis.nc.control.axis_track import RAPID
from fiveaxis.nc.control.program_reader import GIVES_DIRECTIONS, NAMES_NO_AXES, ReadMotion, motion_of_run
from fiveaxis.nc.control.program_toolpath import path_of_run
from fiveaxis.nc.control.running import run_program, take_operation
from fiveaxis.nc.control.technology import TechnologyTrack
from fiveaxis.nc.formats import completed_path, kind_of, read_path_of
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.program import Program
from fiveaxis.nc.source import Source

# mm: diameter of the ball that stands for the tip of an unknown tool.
POINT = 1e-6
_NEAREST = (
    "so the tool's path is read with the rotary angles nearest to those before; the control may choose others"
)
# Rewinds: least distance that the tool goes back along its axis, mm; rounding of the words within which it
# returns, mm and rad; most rows.
LEAST_RETRACT = 1.0
SAME_PLACE, SAME_ANGLE = 0.01, 1e-4
MOST_ROWS = 5000


@dataclass(frozen=True, eq=False)
class TracedProgram:
    """A program that was read, with the path of its tool.

    Parameters
    ----------
    motion : of the axes, one row per block; a list or a table has no technology
    path : of the tool's tip along it, with file and line of each row
    straight : whether the tool's centre moves in a straight line between rows; else all axes run linearly
    by_control : whether it does because the control moves the tip (TCP); the program then doesn't state its
        rotary angles
    by_direction : whether the program gives directions of the tool instead
    """

    motion: ReadMotion
    path: Toolpath
    straight: bool = False
    by_control: bool = False
    by_direction: bool = False

    def placed(self) -> TracedProgram:
        """Leave out moves by axis words before TCP, if where they are on the workpiece isn't known."""
        on = int(np.argmax(self.motion.tcp))
        if not (on and self.motion.tcp[self.motion.cutting].all() and self.motion.from_unknown[on]):
            return self
        path = self.path.at(np.arange(on, len(self.path)))
        return replace(self, motion=self.motion.part(slice(on, None)), path=path)

    @property
    def is_placed(self) -> bool:
        """Whether it is known where its moves are on the machine: not of axis words from an unknown zero."""
        return bool(self.motion.tcp.any()) or not self.motion.zero_unknown

    @property
    def is_table(self) -> bool:
        """Whether it is the table of a motion."""
        return self.motion.technology is None and not self.by_control

    @property
    def tcp_height(self) -> float | None:
        """Height above the tip, mm, of the point that moves straight; None where all axes run linearly.

        A control moves the tip; the table of a motion stands for the tool's centre.
        """
        if not self.straight:
            return None
        return 0.0 if self.by_control else self.path.zone.height


def load_program(
    source: Source, machine: Machine, tool: Tool | None, reading: Reading = Reading()
) -> TracedProgram:
    """Read a program or the table of a motion, and trace its tool.

    This is how programs are read to be verified, priced and posted; `read_path_of` has the same rows, without
    what the machine decides. What doesn't state the axis values (a list of cutter locations, a program with
    tool directions) is read as a path of the tool, and the axes take the angles nearest to those before.

    Parameters
    ----------
    source : a program, a list of cutter locations, or a table as `write_motion` writes it
    machine : on which it runs
    tool : None for the one that comments state, or else its tip alone
    reading : how the program is read

    Raises
    ------
    FiveAxisError
        As `read_program` and `read_motion`.
    """
    if kind_of(source) == "motion":
        return _load_table(source, machine, tool, reading)
    found = _load(source, machine, ReadOptions.of(reading, tool=tool, machine=machine))
    # A program writes the moves of rewinds as feed moves; they are links.
    rewinding = find_rewinds(found.path, machine, found.motion.positions)
    kind = np.where(rewinding, MoveKind.LINK, found.path.kind)
    return replace(found, motion=replace(found.motion, kind=kind), path=replace(found.path, kind=kind))


def load_text(
    text: Program, machine: Machine, start: Mapping[str, float], begin: Array, tool: Tool | None = None
) -> TracedProgram:
    """Read the text of a program that was just composed.

    Parameters
    ----------
    text : as it was composed
    start : where axes stand before it, as for `read_program`
    begin : (1, k), axis values; where tool directions leave the control a choice, it turns the rotary axes to
        the nearest angles
    tool : None for its tip alone

    Raises
    ------
    FiveAxisError
        As `load_program`.
    """
    source = Source(f"program{text.suffix}", list(text.lines))
    options = ReadOptions(start=start, tool=tool, machine=machine)
    return _load(source, machine, options, begin)


def trace_table(motion: Motion, machine: Machine, tool: Tool | None, name: str) -> TracedProgram:
    """Trace the tool of a motion's table, whose centre moves in a straight line between rows."""
    path = trace_tool(motion, machine, tool, name)
    columns = {field.name: getattr(motion, field.name) for field in fields(Motion)}
    never = np.zeros(len(motion), dtype=bool)
    read = ReadMotion(**columns, name=name, tcp=never, from_unknown=never)
    return TracedProgram(read, path, straight=True)


def trace_tool(motion: Motion, machine: Machine, tool: Tool | None, name: str) -> Toolpath:
    """Compute the path of a motion's tool; without a tool that of its tip."""
    tip, axis = tool_poses(machine, motion.positions)
    feed = np.where(np.isfinite(motion.feed) & (motion.feed > 0.0), motion.feed, 1.0)
    return Toolpath.from_tips(
        tip,
        axis,
        tool or Tool.ball(POINT),
        feed_mm_min=60.0 * feed,
        kind=motion.kind,
        source=motion.source,
        name=name,
    )


def with_feeds_of(motion: Motion, path: Toolpath, machine: Machine, *, by_tip: bool = False) -> Toolpath:
    """Set the feeds of a motion's path, or of its tip, so that each move takes as long as in the motion."""
    fed = replace(path, pivot=path.tips(path.axis)) if by_tip else path
    turns = np.abs(motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0)
    at_unit_feed = feed_times(replace(fed, feed=np.ones(len(path))), turns)
    lasting = (motion.time > 0.0) & (at_unit_feed > 0.0)
    feed = np.where(lasting, at_unit_feed / np.where(lasting, motion.time, 1.0), path.feed)
    return replace(path, feed=feed)


def find_rewinds(path: Toolpath, machine: Machine, positions: Array) -> BoolArray:
    """Find the feed moves of rewinds, which cut nothing: the rows, (n,), that belong to one.

    The tool retracts along its axis, rotary axes turn, and it returns along its axis to the same point and
    direction. A program doesn't say that these moves aren't cuts. The path is that of the tip, with the tool
    axis at every row; positions are (n, k), mm and rad.
    """
    tip, axis = path.tips(path.axis), path.axis
    steps = np.diff(tip, axis=0, prepend=tip[:1])
    along = np.sum(steps * axis, axis=1)
    turns = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))[:, machine.rotary_columns]
    turned = turns.max(axis=1, initial=0.0) > SAME_ANGLE
    plain = ~turned & (np.linalg.norm(steps - along[:, None] * axis, axis=1) <= SAME_PLACE)
    cuts = path.kind == MoveKind.CUT
    found = np.zeros(len(tip), dtype=bool)
    for row in np.flatnonzero(plain & cuts & (along >= LEAST_RETRACT)).tolist():
        later = slice(row + 1, row + MOST_ROWS)
        back = (
            (plain & (along <= -LEAST_RETRACT))[later]
            & (np.linalg.norm(tip[later] - tip[row - 1], axis=1) <= SAME_PLACE)
            & (np.linalg.norm(axis[later] - axis[row - 1], axis=1) <= SAME_ANGLE)
        )
        if not back.any():
            continue
        end = row + 1 + int(np.argmax(back))
        if turned[row + 1 : end].any() and cuts[row : end + 1].all():
            found[row : end + 1] = True
    return found


def _load(
    source: Source, machine: Machine, options: ReadOptions, begin: Array | None = None
) -> TracedProgram:
    source = options.of_language(source)
    # The tip alone stands for an unknown tool.
    stand_in = replace(options, stand_in=Tool.ball(POINT))
    if kind_of(source) in ("apt", "points"):
        assumed = source.finding(Severity.WARNING, "angles-assumed", f"it {NAMES_NO_AXES}, {_NEAREST}")
        return _of_path(read_path_of(source, stand_in), source, machine, options, assumed, begin)
    interpreter = run_program(source, machine, options)
    operation, columns = take_operation(interpreter, options)
    pointed = np.isfinite(columns.vectors[:, 0])
    if pointed.any():
        path = path_of_run(interpreter, operation, columns, stand_in)
        text = f"it isn't a motion of the axes ({GIVES_DIRECTIONS}), {_NEAREST}"
        line = int(columns.lines[pointed][0])
        assumed = source.finding(Severity.WARNING, "angles-assumed", text, line)
        technology = interpreter.modes.technology.track(columns.steps[columns.moved])
        path = completed_path(path, "program", options)
        return _of_path(path, source, machine, options, assumed, begin, technology)
    motion = motion_of_run(interpreter, operation, columns, options)
    path = trace_tool(motion, machine, options.tool or motion.tool, motion.name)
    return TracedProgram(motion, path)


def _load_table(source: Source, machine: Machine, tool: Tool | None, reading: Reading) -> TracedProgram:
    motion = read_motion(source, machine, source_is_table=True)
    given = sorted(name for name in options_of(Reading) if getattr(reading, name))
    if given:
        raise SettingError(
            f"{', '.join(given)} is for NC programs, and this is the table of a motion", file=source.name
        )
    return trace_table(motion, machine, tool, Path(source.name).name)


def _of_path(
    path: Toolpath,
    source: Source,
    machine: Machine,
    options: ReadOptions,
    assumed: Finding,
    begin: Array | None,
    technology: TechnologyTrack | None = None,
) -> TracedProgram:
    """Trace a path that doesn't state the axis values; `assumed` says why, `technology` is a program's."""
    if not path.has_axes:
        raise source.error(
            "has contacts and normals, and no tool axes; choose them first (optimise, `fiveaxis optimise`)"
        )
    positions = _follow_branches(path, machine, begin)
    # Normals that a program gives belong to contacts; here the tool is traced by its tip.
    bare = Toolpath.from_tips(
        path.tips(path.axis),
        path.axis,
        path.tool,
        feed_mm_min=60.0 * path.feed,
        kind=path.kind,
        source=path.source,
        name=path.name,
    )
    time = block_times(path if options.rapid else path.with_rapid(RAPID), machine, positions)
    if technology is not None:
        # F is the tip's; a block that is too fast for an axis is a finding, not a slower block.
        by_tip = replace(path, pivot=path.tips(path.axis))
        turns = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))[:, machine.rotary_columns]
        time = np.where(path.rapid, time, feed_times(by_tip, turns.max(axis=1, initial=0.0)))
    motion = ReadMotion(
        letters=machine.letters,
        positions=positions,
        feed=path.feed,
        time=time,
        kind=path.kind,
        source=path.source,
        name=source.name,
        tcp=np.ones(len(path), dtype=bool),
        from_unknown=np.zeros(len(path), dtype=bool),
        technology=technology,
        operation=path.operation,
        tool=None if path.tool == Tool.ball(POINT) else path.tool,
        ignored=path.ignored,
        findings=(assumed, *path.findings),
    )
    return TracedProgram(
        motion,
        bare,
        straight=True,
        by_control=True,
        by_direction=path.rotary is None or bool(np.isnan(path.rotary).any()),
    )


def _follow_branches(path: Toolpath, machine: Machine, begin: Array | None) -> Array:
    """Solve the axes, (n, k), each row on the branch and turns nearest to the row before.

    The first row is nearest to `begin`, (1, k), or to zero. A branch outside the limits is taken only where
    there is no other; the check of limits then reports it.
    """
    branches = axis_positions(machine, path.tips(path.axis), path.axis)
    columns = machine.rotary_columns
    low, high = machine.low[columns], machine.high[columns]
    found = np.full(branches.shape[1:], np.nan)
    before = np.clip(np.zeros(len(columns)) if begin is None else begin[0, columns], low, high)
    for i in range(len(found)):
        rows = branches[:, i].copy()
        rows[:, columns] = nearest_turn(rows[:, columns], before, low, high)
        turn = np.abs(rows[:, columns] - before).sum(axis=1)
        outside = (machine.limit_excess(rows) > 1e-9).any(axis=1)
        order = np.lexsort((turn, outside, np.isnan(rows).any(axis=1)))
        found[i] = rows[order[0]]
        if np.isfinite(found[i]).all():
            before = found[i, columns]
    return found
