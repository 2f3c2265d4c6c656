"""What `verify_program` checks: a program, or the table of a motion, as a motion and the path of its tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.job.rewinds import find_rewinds
from fiveaxis.kinematics import axis_positions, tool_poses
from fiveaxis.kinematics.windings import nearest_turn
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion, block_times, feed_times
from fiveaxis.nc import Program, read_motion
from fiveaxis.nc.control.program_reader import read_motion_of
from fiveaxis.nc.control.spindle import spindle_of
from fiveaxis.nc.formats import POINT_SUFFIXES, read_path_of
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import APT_SUFFIXES, Source, lists_locations, load_source
from fiveaxis.toolpath import MoveKind, Tool, Toolpath

# The table of a motion, beside the programs.
MOTION_SUFFIX = ".csv"
# Suffix by which lists of cutter locations are read, whatever their control's table calls its files.
LISTS = {"apt": ".apt", "points": ".csv"}
# mm: diameter of a ball that stands for the tip of a tool that nobody names.
POINT = 1e-6
# mm/min: of rapid moves of axes whose speed nobody knows; nothing but their duration depends on it.
RAPID = 10_000.0


@dataclass(frozen=True, eq=False)
class CheckedProgram:
    """A program as the checks see it.

    Parameters
    ----------
    motion : of the axes, one row a block
    path : of the tool's tip along it, which knows file and line of each row
    findings : what reading assumed or left out
    tcp : (n,), which moves are those of the tool's tip, under TCP
    spindle : (n,), rev/min, as `ReadMotion.spindle`
    straight : whether the tool's centre goes straight between rows; else all axes run linearly
    by_control : whether that is because the control moves its tip (TCP)
    """

    motion: Motion
    path: Toolpath
    findings: tuple[Finding, ...]
    tcp: BoolArray
    spindle: Array
    straight: bool = False
    by_control: bool = False

    @property
    def assumes_angles(self) -> bool:
        """Whether the program doesn't name its rotary angles."""
        return self.by_control

    @property
    def tcp_height(self) -> float | None:
        """Height above the tip, mm, of the point that goes straight; None where all axes run linearly.

        A control leads the tip, and a motion's table stands for the tool's centre.
        """
        if not self.straight:
            return None
        return 0.0 if self.by_control else self.path.zone.height


def load_program(
    file: str | Path, machine: Machine, tool: Tool | None, reading: Mapping[str, Any]
) -> CheckedProgram:
    """Read a program or the table of a motion, and follow its tool.

    A program that doesn't say where the axes are (directions of the tool, places that only the machine knows)
    is read as a path of the tool, and the axes take the angles next to those before.

    Parameters
    ----------
    file : a program, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    tool : None for its tip alone
    reading : as for `read_program`

    Raises
    ------
    FiveAxisError
        As `read_program` and `read_motion`.
    """
    path = Path(file)
    name = path.with_suffix("") if path.suffix.lower() == ".gz" else path
    try:
        if name.suffix.lower() == MOTION_SUFFIX:
            return _load_table(path, machine, tool, reading)
    except ToolpathError as table_fault:
        # Not the table of a motion: perhaps a list of points.
        return _with_links(
            _load_path(load_source(path), machine, _options(machine, tool, reading), table_fault), machine
        )
    return _with_links(_load(load_source(path), machine, _options(machine, tool, reading)), machine)


def load_text(
    text: Program, machine: Machine, start: Mapping[str, float], begin: Array, tool: Tool | None = None
) -> CheckedProgram:
    """Read a program of our own whose text is at hand.

    Parameters
    ----------
    text : as it was composed
    start : where axes stand before it, as for `read_program`
    begin : (1, k), axis values next to which the control turns the rotary axes where directions of the tool
        leave it the choice
    tool : None for its tip alone

    Raises
    ------
    FiveAxisError
        As `load_program`.
    """
    source = Source(f"program{text.suffix}", list(text.lines))
    options = _options(machine, tool, {"start": start})
    if text.language != "blocks":
        named = replace(source, name=f"program{LISTS[text.language]}")
        return _load_path(named, machine, options, source.error("it can't be read as a path"), begin)
    return _load(source, machine, options, begin)


def _options(machine: Machine, tool: Tool | None, reading: Mapping[str, Any]) -> ReadOptions:
    given = {name: value for name, value in reading.items() if value is not None}
    return ReadOptions(tool=tool, machine=machine, **({"rapid_mm_min": RAPID} | given))


def _load(
    source: Source, machine: Machine, options: ReadOptions, begin: Array | None = None
) -> CheckedProgram:
    try:
        if lists_locations(source.name):
            raise source.error("is a list of cutter locations, which names no axes")
        motion = read_motion_of(source, machine, options)
    except ToolpathError as fault:
        return _load_path(source, machine, options, fault, begin)
    return CheckedProgram(
        motion,
        tool_path(motion, machine, options.tool, motion.name),
        motion.findings,
        motion.tcp,
        motion.spindle,
    )


def _with_links(read: CheckedProgram, machine: Machine) -> CheckedProgram:
    """Call the moves of rewinds links: a program writes them as feed moves."""
    rewinding = find_rewinds(read.path, machine, read.motion.positions)
    kind = np.where(rewinding, MoveKind.LINK, read.path.kind)
    return replace(read, motion=replace(read.motion, kind=kind), path=replace(read.path, kind=kind))


def _load_table(
    path: Path, machine: Machine, tool: Tool | None, reading: Mapping[str, Any]
) -> CheckedProgram:
    motion = read_motion(path, machine, source_is_table=True)
    said = sorted(key for key, value in reading.items() if value)
    if said:
        raise SettingError(
            f"{', '.join(said)} is for NC programs, and this is the table of a motion", file=path
        )
    none = np.zeros(len(motion))
    return CheckedProgram(
        motion, tool_path(motion, machine, tool, path.name), (), none > 0, none, straight=True
    )


def tool_path(motion: Motion, machine: Machine, tool: Tool | None, name: str) -> Toolpath:
    """Follow the tool of a motion; one of none for its tip alone."""
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


def in_time(path: Toolpath, machine: Machine, motion: Motion) -> Toolpath:
    """Give a motion's path the feeds at which its moves take as long as the motion says."""
    turn = np.abs(motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0)
    unhurried = feed_times(replace(path, feed=np.ones(len(path))), turn)
    lasting = (motion.time > 0.0) & (unhurried > 0.0)
    feed = np.where(lasting, unhurried / np.where(lasting, motion.time, 1.0), path.feed)
    return replace(path, feed=feed)


def _load_path(
    source: Source,
    machine: Machine,
    options: ReadOptions,
    fault: ToolpathError,
    begin: Array | None = None,
) -> CheckedProgram:
    """Read a program as a path of the tool, because it isn't one of the axes; or say why it isn't."""
    try:
        path = read_path_of(source, replace(options, tool=options.tool or Tool.ball(POINT)))
    except ToolpathError:
        if lists_locations(source.name):
            raise
        raise fault from None
    if not path.has_axes:
        raise fault
    positions = _next_to_each_other(path, machine, begin)
    motion = Motion(
        letters=machine.letters,
        positions=positions,
        feed=path.feed,
        time=block_times(path, machine, positions),
        kind=path.kind,
        source=path.source,
    )
    assumed = Finding(
        Severity.WARNING,
        "angles-assumed",
        f"it isn't a motion of the axes ({fault.message}), so the tool's path is checked, and the axes on "
        "the angles next to those before; the control may take others",
        Place(line=fault.line, file=path.name),
    )
    # Normals that a program gives belong to contacts; the tool is followed by its tip here.
    bare = Toolpath.from_tips(
        path.tips(path.axis),
        path.axis,
        path.tool,
        feed_mm_min=60.0 * path.feed,
        kind=path.kind,
        source=path.source,
        name=path.name,
    )
    lists = Path(source.name).suffix.lower() in (*APT_SUFFIXES, *POINT_SUFFIXES)
    spindle = np.zeros(len(path)) if lists else spindle_of(source, path.source)
    tcp = np.ones(len(path), dtype=bool)
    return CheckedProgram(
        motion, bare, (assumed, *path.findings), tcp, spindle, straight=True, by_control=True
    )


def _next_to_each_other(path: Toolpath, machine: Machine, begin: Array | None) -> Array:
    """Solve the axes, (n, k), each row with the turns and the branch nearest to the row before.

    The first is nearest to `begin`, (1, k), or to zero. Of branches outside the limits one is taken only
    where there is no other: the check of limits names it.
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
        outside = ((rows < machine.low - 1e-9) | (rows > machine.high + 1e-9)).any(axis=1)
        order = np.lexsort((turn, outside, np.isnan(rows).any(axis=1)))
        found[i] = rows[order[0]]
        if np.isfinite(found[i]).all():
            before = found[i, columns]
    return found
