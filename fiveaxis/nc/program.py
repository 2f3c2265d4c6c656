"""NC programs: a motion as the blocks of a control, or as a list of cutter locations for other posts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import (
    USUAL_CONTROL,
    Array,
    Coordinates,
    Finding,
    MachineError,
    SettingError,
    Severity,
    ToolpathError,
    Winding,
)
from fiveaxis.model import STANDSTILL, Machine, Motion, ProgramMotion
from fiveaxis.nc.control.program_reader import ReadMotion
from fiveaxis.nc.words import feed_text
from fiveaxis.nc.writing.blocks import block_lines
from fiveaxis.nc.writing.feeds import SECONDS
from fiveaxis.nc.writing.header import Note, head_lines, machine_notes
from fiveaxis.nc.writing.program_settings import ProgramSettings, require_writable
from fiveaxis.nc.writing.start_and_end import NO_ROW, StartAndEnd, numbered
from fiveaxis.nc.writing.tables import find_dialect
from fiveaxis.nc.writing.turns import require_winding
from fiveaxis.nc.writing.word_writer import WordWriter, require_expressible

Header = Mapping[str, str] | Sequence[tuple[str, str]]

# Header of a program that hasn't been verified.
NOT_VERIFIED = (
    ("verification", "NOT VERIFIED, nobody has checked limits, contact, gouges or collisions of this motion"),
)

# mm, rad: rounding of an axis value beyond its travel.
BEYOND = 1e-6

COLUMNS = "x,y,z,i,j,k,feed,cut,rapid"


@dataclass(frozen=True)
class Preparation:
    """What a program needs at the machine before it starts, and what it sets itself.

    Parameters
    ----------
    notes : the requirements; the header has those that an operator needs, in few words
    tool_number : of the tool change; None if the program has none
    work_offset : the control's word; empty if it has none
    in_force : blocks that set modes, offsets, tool, spindle and coolant
    start : where the approach leads: letter and value, deg and `unit`, in the order in which the axes move
    unit : of lengths
    """

    notes: tuple[Note, ...]
    tool_number: int | None = None
    work_offset: str = ""
    in_force: tuple[str, ...] = ()
    start: tuple[tuple[str, float], ...] = ()
    unit: str = "mm"

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {
            "tool_number": self.tool_number,
            "work_offset": self.work_offset,
            "in_force": list(self.in_force),
            "start": dict(self.start),
            "unit": self.unit,
            "notes": [{"about": note.about, "text": note.text} for note in self.notes],
        }


@dataclass(frozen=True)
class Program:
    """The text of an NC program.

    Parameters
    ----------
    control : name of the dialect
    suffix : of files for this control
    lines : comments and blocks in order
    rows : for each line, the row of the program's motion at which its move ends; -1 for none
    dropped : number of moves omitted because no axis moves by a step of the control's decimals
    coordinates : that the words are written in
    language : ``blocks`` of a control, or ``apt`` or ``points`` for a list of cutter locations
    findings : what was assumed, and where the control deviates from the plan
    preparation : what the program needs at the machine
    revises : what was revised in place: operation and lines of another program; empty for one of its own
    data : the file's bytes, of a program that was revised
    """

    control: str
    suffix: str
    lines: tuple[str, ...]
    rows: tuple[int, ...]
    dropped: int
    coordinates: Coordinates = "axes"
    language: str = "blocks"
    findings: tuple[Finding, ...] = ()
    preparation: Preparation = Preparation(())
    revises: str = ""
    data: bytes | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        return f"<Program for {self.control}: {len(self.lines)} lines, {self.coordinates}>"

    @property
    def text(self) -> str:
        """The file's content; the same motion gives the same bytes."""
        return "\n".join(self.lines) + "\n"


def control_for(machine: Machine, control: str | Path | None = None) -> str | Path:
    """Return the control of a program: the given one, or else that of the machine, or else LinuxCNC.

    Raises
    ------
    MachineError
        The machine's is unknown.
    """
    if control is not None or not machine.control:
        return control or USUAL_CONTROL
    try:
        find_dialect(machine.control)
    except SettingError as fault:
        raise MachineError(f"machine {machine.name!r}: {fault}") from None
    return machine.control


def require_program(
    machine: Machine,
    control: str | Path,
    coordinates: Coordinates | None = None,
    winding: Winding = "unwound",
    settings: ProgramSettings | None = None,
) -> WordWriter:
    """Check that a machine's motions can be written for a control, and return how positions become words.

    Raises
    ------
    SettingError, MachineError
        See `compose_program`.
    """
    dialect = find_dialect(control)
    settings = settings or ProgramSettings()
    chosen = require_expressible(dialect, coordinates, machine)
    require_writable(settings, dialect, machine.letters)
    writer = WordWriter(dialect, chosen, machine, settings.unit)
    require_winding(winding, writer)
    return writer


def compose_program(
    motion: Motion | ProgramMotion,
    *,
    machine: Machine,
    control: str | Path | None = None,
    coordinates: Coordinates | None = None,
    header: Header | None = None,
    winding: Winding = "unwound",
    settings: ProgramSettings | None = None,
    verdict: Sequence[tuple[str, str]] = NOT_VERIFIED,
    beyond: bool = False,
) -> Program:
    """Write the text of a program; it is not verified, and no blocks are inserted.

    `fiveaxis.job.program.make_program` plans a program's motion, writes it with this function, reads it back
    and verifies it.

    Rotary words are the motion's angles in the control's sign, so that the machine moves as optimised; only
    tool directions leave them to the control. Every move is one block that moves all axes in proportion in
    the motion's time: F is its inverse, or the tip's speed along its path.

    The approach has no duration: the rotary axes turn at the tool's current position, then the linear axes
    move.

    Parameters
    ----------
    motion : axis values and durations; a bare motion gets the default approach and leads
        (`ProgramMotion.around`), one that was read from a program keeps its own end
    machine : of the motion
    control : a key of `DIALECTS`, or the path of a custom table (``.toml``); by default the machine's, or
        ``linuxcnc`` where its file states none
    coordinates : ``axes``, positions of the machine's axes; ``tip``, the tool tip on the workpiece and the
        rotary angles (TCP); ``vector``, the tip and the tool direction. By default the first that the control
        has
    header : name and value of further comments, in order: tool, source, energy
    winding : how turns of rotary axes with more than one turn are written: ``unwound``, unwrapped;
        ``modulo``, from 0 to 360, with moves of half a turn or more divided; ``rezero``, reset by whole turns
        where a link begins. `DIALECTS` lists what a control has and requires
    settings : tool, spindle, coolant, work offset and so on; the header lists what isn't written
    verdict : names and texts of the header on verification
    beyond : whether positions beyond an axis's travel are written

    Raises
    ------
    SettingError
        An unknown control; coordinates, a winding or settings that the control or the machine doesn't have.
    MachineError
        The motion has other axes than the machine, or the control doesn't know an axis of the machine.
    ToolpathError
        No location; a value that isn't finite; an axis beyond its travel; a feed that isn't positive or out
        of the control's range; a move without duration.
    """
    settings = settings or ProgramSettings()
    writer = require_program(machine, control_for(machine, control), coordinates, winding, settings)
    planned = motion if isinstance(motion, ProgramMotion) else _with_usual_leads(motion, writer, settings)
    if not beyond:
        _require_travel(planned.blocks, machine)
    pairs = [*(header.items() if isinstance(header, Mapping) else header or ())]
    if writer.dialect.language == "blocks":
        return _program_of_blocks(planned, StartAndEnd(writer, settings, winding), verdict, pairs)
    head = head_lines(writer, settings, verdict, pairs, winding)
    lines = tuple(location_lines(planned.blocks, writer, head))
    dialect = writer.dialect
    return Program(
        control=dialect.name,
        suffix=dialect.suffix,
        lines=lines,
        rows=(NO_ROW,) * len(lines),
        dropped=0,
        coordinates=writer.coordinates,
        language=dialect.language,
        preparation=Preparation(tuple(machine_notes(writer, settings, winding)), unit=settings.unit),
    )


def require_motion(motion: Motion, machine: Machine) -> None:
    """Raise as `compose_program` if a motion has other axes than the machine, or invalid numbers."""
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}, and machine {machine.name!r} has {machine.letters}"
        )
    if len(motion) == 0:
        raise ToolpathError("the motion has no locations; there is nothing to write")
    valid = np.isfinite(motion.positions).all(axis=1) & np.isfinite(motion.time)
    valid &= np.isfinite(motion.feed) & (motion.feed > 0.0)
    if not valid.all():
        row = int(np.argmin(valid))
        raise ToolpathError(
            f"location {row} has an axis value or duration that isn't finite, or a feed that isn't above 0 "
            f"({int((~valid).sum())} such locations); no program is written",
            line=int(motion.source[row]),
        )


def _with_usual_leads(motion: Motion, writer: WordWriter, settings: ProgramSettings) -> ProgramMotion:
    require_motion(motion, writer.machine)
    # A program that was read keeps its end: its last feed moves may be a lead-out already.
    keeps_end = not settings.way_out or isinstance(motion, ReadMotion)
    lead_out = np.zeros(len(motion.letters)) if keeps_end else None
    return ProgramMotion.around(motion, writer.machine, writer.interpolation, lead_out=lead_out)


def _program_of_blocks(
    planned: ProgramMotion,
    around: StartAndEnd,
    verdict: Sequence[tuple[str, str]],
    pairs: Sequence[tuple[str, str]],
) -> Program:
    """Assemble the header, with its pairs of name and value, the moves and the blocks around them."""
    writer, dialect, settings = around.writer, around.writer.dialect, around.settings
    assumed, wound = around.assumptions(), around.wound(planned)
    pairs = [*(("assumed", text) for text in assumed), *pairs, *_lead_out_note(planned)]
    blocks, dropped, told = block_lines(planned.blocks, writer, around.winding)
    comments = head_lines(writer, settings, verdict, pairs, around.winding, wound)
    head = [*around.head(), *comments, *around.modes()]
    tagged = [
        *((line, NO_ROW) for line in head),
        *around.approach(planned),
        *((line, row + planned.first) for line, row in blocks),
        *around.lead_out(planned),
        *((line, NO_ROW) for line in around.end()),
    ]
    lines = tuple(numbered([line for line, _ in tagged], writer, around.settings.line_numbers))
    _require_width(lines, writer)
    findings = [Finding(Severity.WARNING, "number-assumed", text) for text in assumed]
    if settings.missing:
        todo = ", ".join(settings.missing)
        text = f"the operator has to see to it before the start: {todo}; or ask for it in the job ([nc])"
        findings.append(Finding(Severity.NOTE, "operator", text))
    findings += [Finding(Severity.NOTE, "wound", f"the program {text}") for text in wound]
    return Program(
        control=dialect.name,
        suffix=dialect.suffix,
        lines=lines,
        rows=tuple(row for _, row in tagged),
        dropped=dropped,
        coordinates=writer.coordinates,
        findings=(*findings, *told),
        preparation=Preparation(
            notes=tuple(machine_notes(writer, around.settings, around.winding)),
            tool_number=around.settings.tool_number,
            work_offset=around.work_offset,
            in_force=tuple(around.in_force()),
            start=around.start(planned),
            unit=around.settings.unit,
        ),
    )


def _lead_out_note(planned: ProgramMotion) -> list[tuple[str, str]]:
    """Return the header's note on the lead-out."""
    length = float(np.linalg.norm(planned.lead_out, axis=-1))
    if length <= STANDSTILL:
        return []
    return [("lead out", f"the program leads the tool {length:.3g} mm off its last cut, at the cut's feed")]


def _require_travel(motion: Motion, machine: Machine) -> None:
    """Raise if a position is beyond the machine's travel: the control would stop there."""
    beyond = machine.limit_excess(motion.positions) > BEYOND
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


def _require_width(lines: Sequence[str], writer: WordWriter) -> None:
    longest = max(lines, key=len)
    if len(longest) > writer.dialect.longest:
        raise SettingError(
            f"{longest[:40]!r}… has {len(longest)} characters, and control {writer.dialect.name!r} reads "
            f"{writer.dialect.longest}; write fewer decimals, or no block numbers"
        )


def location_lines(motion: Motion, writer: WordWriter, header: Sequence[str]) -> list[str]:
    """Write every location of a motion, after the comment lines `header`."""
    values = writer.rounded(writer.values(motion.positions))
    if writer.dialect.language == "apt":
        return [*header, "UNITS/MM", "MULTAX/ON", *_apt(motion, writer, values), "FINI"]
    return [*header, COLUMNS, *_points(motion, writer, values)]


def _apt(motion: Motion, writer: WordWriter, values: Array) -> Iterator[str]:
    """Write GOTO for each location, FEDRAT where the feed changes, RAPID before each rapid move."""
    goto, now = "GOTO/" + ",".join(f"%.{int(d)}f" for d in writer.decimals), ""
    for row, is_rapid, feed in zip(values.tolist(), motion.rapid, _feeds(motion, writer), strict=True):
        if is_rapid:
            yield "RAPID"
        elif feed != now:
            yield f"FEDRAT/{feed},MMPM"
            now = feed
        yield goto % tuple(row)


def _points(motion: Motion, writer: WordWriter, values: Array) -> Iterator[str]:
    point = ",".join(f"%.{int(d)}f" for d in writer.decimals)
    kinds = zip(motion.cutting.astype(int), motion.rapid.astype(int), strict=True)
    for row, feed, (cut, rapid) in zip(values.tolist(), _feeds(motion, writer), kinds, strict=True):
        yield f"{point % tuple(row)},{feed},{cut},{rapid}"


def _feeds(motion: Motion, writer: WordWriter) -> list[str]:
    """Format the feed of each location, mm/min."""
    return [feed_text(feed, writer.dialect.feed["per_minute"]) for feed in (motion.feed * SECONDS).tolist()]
