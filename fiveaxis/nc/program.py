"""NC programs: a motion as blocks of one control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiveaxis.errors import MachineError, SettingError, ToolpathError
from fiveaxis.files import write_atomically
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import STANDSTILL, Motion, motion_digest
from fiveaxis.nc.control.program_reader import ProgramMotion
from fiveaxis.nc.gate import Verdict, checked_lead_in, checked_lead_out, pass_gate
from fiveaxis.nc.writing.blocks import block_lines
from fiveaxis.nc.writing.catalogue import find_dialect
from fiveaxis.nc.writing.cutter_locations import location_lines
from fiveaxis.nc.writing.framing import Frame, numbered
from fiveaxis.nc.writing.header import head_lines
from fiveaxis.nc.writing.leads import LAST, clear_way
from fiveaxis.nc.writing.places import Wording, require_expressible
from fiveaxis.nc.writing.program_settings import ProgramSettings, require_writable
from fiveaxis.nc.writing.table_parts import Coordinates
from fiveaxis.nc.writing.turns import Winding, require_winding

Header = Mapping[str, str] | Sequence[tuple[str, str]]

# mm, rad: an axis value may be so far beyond its travel, from rounding.
BEYOND = 1e-6


@dataclass(frozen=True)
class Program:
    """The blocks of one control.

    Parameters
    ----------
    control : name of the dialect
    suffix : that files of this control have
    lines : comments and blocks in order
    dropped : moves left out, because no axis moves in them as far as the control's decimals show
    coordinates : what the words are
    findings : what was assumed, and what the control does otherwise than it was planned
    """

    control: str
    suffix: str
    lines: tuple[str, ...]
    dropped: int
    coordinates: Coordinates = "axes"
    findings: tuple[Finding, ...] = ()

    @property
    def text(self) -> str:
        """The file's content; the same motion gives the same bytes."""
        return "\n".join(self.lines) + "\n"


def write_program(
    motion: Motion,
    path: str | Path,
    *,
    machine: Machine,
    control: str | Path = "linuxcnc",
    coordinates: Coordinates | None = None,
    header: Header | None = None,
    winding: Winding = "unwound",
    report: Verdict | None = None,
    override: Sequence[str] = (),
    settings: ProgramSettings | None = None,
) -> Path:
    """Write a motion as an NC program; see `compose_program` for what stands in it.

    The file appears whole or not at all; missing folders are made. A control that names its programs takes
    the file's name, where the settings give none.

    Returns
    -------
    `path`

    Raises
    ------
    SettingError
        A file that can't be written; see `compose_program`.
    MachineError, ToolpathError, Unverified
        See `compose_program`.
    """
    settings = settings or ProgramSettings()
    if settings.name is None:
        settings = settings.model_copy(update={"name": Path(path).stem[:60] or None})
    program = compose_program(
        motion,
        machine=machine,
        control=control,
        coordinates=coordinates,
        header=header,
        winding=winding,
        report=report,
        override=override,
        settings=settings,
    )
    return write_atomically(path, program.text)


def require_program(
    machine: Machine,
    control: str | Path,
    coordinates: Coordinates | None = None,
    winding: Winding = "unwound",
    settings: ProgramSettings | None = None,
) -> Wording:
    """Check that a control can write a machine's motions as asked, before there is one.

    Returns
    -------
    How places become its words.

    Raises
    ------
    SettingError, MachineError
        See `compose_program`.
    """
    dialect = find_dialect(control)
    settings = settings or ProgramSettings()
    chosen = require_expressible(dialect, coordinates, machine)
    require_writable(settings, dialect, machine.letters)
    wording = Wording(dialect, chosen, machine, settings.unit)
    require_winding(winding, wording)
    return wording


def compose_program(
    motion: Motion,
    *,
    machine: Machine,
    control: str | Path = "linuxcnc",
    coordinates: Coordinates | None = None,
    header: Header | None = None,
    winding: Winding = "unwound",
    report: Verdict | None = None,
    override: Sequence[str] = (),
    settings: ProgramSettings | None = None,
) -> Program:
    """Write the blocks of a motion.

    Rotary words are the motion's own angles in the control's sign, so that the machine does what was
    optimised; only directions of the tool leave them to the control. Every move is one block that moves all
    axes in proportion, links and rapid moves too, and takes the motion's time: F is the inverse of it, or the
    tip's way over it.

    The way to the first location has no duration: the rotary axes turn where the tool is, then the linear
    axes move. A first cut is approached in rapid only up to 5 mm along the tool axis, less where an axis
    limit is nearer; where the report found another way to be clear, that one is taken. A last cut is left in
    the same manner, before the program retracts and ends; a program that was read has its own end.

    Parameters
    ----------
    motion : axis values and durations
    machine : whose axes they are
    control : a key of `DIALECTS`, or the path of a table of one's own (``.toml``)
    coordinates : ``axes``, positions of the machine's axes; ``tip``, the tool's tip on the workpiece and the
        rotary angles (tool centre point control); ``vector``, the tip and the tool's direction. By default
        the first of them that the control has
    header : name and value of further comments, in order: tool, source, energy
    winding : how rotary axes of more than one turn are counted: ``unwound``, on and on; ``modulo``, from 0 to
        360, moves of half a turn or more cut into parts; ``rezero``, named anew by whole turns where a link
        begins. Which of them a control has, and what it needs for it, stands in `DIALECTS`
    report : what `verify` found; the header says what it rests on. Without one the header says NOT VERIFIED
    override : codes of errors in the report that are accepted; the header names each
    settings : tool, spindle, coolant, work offset and so on; the header says what isn't written

    Raises
    ------
    Unverified
        The report has an error that isn't accepted, or is about another motion; or, in positions of the
        machine's axes, the tool leaves its way between blocks.
    SettingError
        An unknown control; coordinates, a winding or settings that the control or the machine hasn't; an
        override of a code that doesn't exist or didn't occur.
    MachineError
        The motion has other axes than the machine, or the machine axes that the control doesn't know.
    ToolpathError
        No location; a value that isn't finite; an axis beyond its travel; a feed that isn't positive or that
        the control doesn't read; a move that takes no time.
    """
    settings = settings or ProgramSettings()
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}, and machine {machine.name!r} has {machine.letters}"
        )
    wording = require_program(machine, control, coordinates, winding, settings)
    about = None if report is None else motion_digest(motion, machine)
    verified = pass_gate(report, override, led=wording.coordinates != "axes", about=about)
    _require_numbers(motion)
    if "axis-limit" not in override:
        _require_travel(motion, machine)
    pairs = [*(header.items() if isinstance(header, Mapping) else header or ()), *verified]
    if wording.dialect.language == "blocks":
        leads = checked_lead_in(report), _lead_out(motion, machine, settings, report)
        return _program_of_blocks(motion, Frame(wording, settings, winding), pairs, leads)
    lines = location_lines(motion, wording, head_lines(wording, settings, pairs, winding))
    return Program(wording.dialect.name, wording.dialect.suffix, tuple(lines), 0, wording.coordinates)


def _program_of_blocks(
    motion: Motion, frame: Frame, pairs: Sequence[tuple[str, str]], leads: tuple[Array | None, Array]
) -> Program:
    """Put a program together: what stands around the moves, the header, and the moves.

    Parameters
    ----------
    pairs : name and value of the header's comments
    leads : (k,), mm, the last of the way to the first location, back from there, None for the usual one; and
        the way off the last location
    """
    wording, dialect = frame.wording, frame.wording.dialect
    assumed = frame.assumptions()
    lead_in, lead_out = leads
    said = [*pairs, *_said_of_end(lead_out), *(("assumed", text) for text in assumed)]
    blocks = block_lines(motion, wording, frame.winding)
    lines = [
        *frame.head(),
        *head_lines(wording, frame.settings, said, frame.winding),
        *frame.modes(),
        *frame.approach(motion, lead_in),
        *blocks.lines,
        *frame.way_out(motion, lead_out),
        *frame.end(),
    ]
    lines = list(numbered(lines, wording, frame.settings.line_numbers))
    _require_width(lines, wording)
    findings = (*(Finding(Severity.WARNING, "number-assumed", text) for text in assumed), *blocks.findings)
    return Program(dialect.name, dialect.suffix, tuple(lines), blocks.dropped, wording.coordinates, findings)


def _lead_out(motion: Motion, machine: Machine, settings: ProgramSettings, report: Verdict | None) -> Array:
    """Give the way off the last location, (k,) mm: as the report has checked it, else the usual one."""
    # A program that was read ends where its author let it end: its last feed moves may well lead out.
    if not settings.way_out or isinstance(motion, ProgramMotion):
        return np.zeros(len(machine.letters))
    checked = checked_lead_out(report)
    return clear_way(motion, machine, row=LAST) if checked is None else checked


def _said_of_end(lead_out: Array) -> list[tuple[str, str]]:
    """Say in the header how the program leaves a last cut."""
    length = float(np.linalg.norm(lead_out))
    if length <= STANDSTILL:
        return []
    return [("way out", f"the program leads the tool {length:.3g} mm off its last cut, at the cut's feed")]


def _require_numbers(motion: Motion) -> None:
    if len(motion) == 0:
        raise ToolpathError("the motion has no locations; there is nothing to write")
    sound = np.isfinite(motion.positions).all(axis=1) & np.isfinite(motion.time)
    sound &= np.isfinite(motion.feed) & (motion.feed > 0.0)
    if not sound.all():
        row = int(np.argmin(sound))
        raise ToolpathError(
            f"location {row} has an axis value or duration that isn't finite, or a feed that isn't above 0 "
            f"({int((~sound).sum())} such locations); no program is written",
            line=int(motion.source[row]),
        )


def _require_travel(motion: Motion, machine: Machine) -> None:
    """Refuse a place that the machine doesn't reach: the control would stop there."""
    beyond = (motion.positions < machine.low - BEYOND) | (motion.positions > machine.high + BEYOND)
    if not beyond.any():
        return
    row, column = (int(i) for i in np.argwhere(beyond)[0])
    axis = machine.axes[column]
    value, low, high = (
        axis.shown(v) for v in (motion.positions[row, column], axis.limits.low, axis.limits.high)
    )
    side, bound = ("below", low) if value < low else ("above", high)
    raise ToolpathError(
        f"location {row}: {axis.letter} = {value:.6g} {axis.unit} is {side} the limit {bound:g} {axis.unit} "
        f"of machine {machine.name!r} ({int(beyond.any(axis=1).sum())} such locations); move the part "
        "(work_offset), or narrow the tilt range",
        line=int(motion.source[row]),
    )


def _require_width(lines: Sequence[str], wording: Wording) -> None:
    longest = max(lines, key=len)
    if len(longest) > wording.dialect.longest:
        raise SettingError(
            f"{longest[:40]!r}… has {len(longest)} characters, and control {wording.dialect.name!r} reads "
            f"{wording.dialect.longest}; write fewer decimals, or no block numbers"
        )
