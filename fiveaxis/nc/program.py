"""NC programs: a motion as blocks of one control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiveaxis.errors import MachineError, SettingError, ToolpathError
from fiveaxis.findings import Finding, Severity
from fiveaxis.machine import Machine
from fiveaxis.motion import STANDSTILL, Motion, ProgramMotion
from fiveaxis.nc.control.program_reader import ReadMotion
from fiveaxis.nc.writing.blocks import block_lines
from fiveaxis.nc.writing.catalogue import find_dialect
from fiveaxis.nc.writing.cutter_locations import location_lines
from fiveaxis.nc.writing.framing import NO_ROW, Frame, numbered
from fiveaxis.nc.writing.header import head_lines
from fiveaxis.nc.writing.places import Wording, require_expressible
from fiveaxis.nc.writing.program_settings import ProgramSettings, require_writable
from fiveaxis.nc.writing.table_parts import Coordinates
from fiveaxis.nc.writing.turns import Winding, require_winding

Header = Mapping[str, str] | Sequence[tuple[str, str]]

# What the header of a program says that nobody has verified.
NOT_VERIFIED = (
    (
        "verification",
        "NOT VERIFIED, nobody has checked limits, contact, gouges or collisions of this motion",
    ),
)

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
    rows : for each line, the row of the program's motion at which the move ends that it writes; -1 for none
    dropped : moves left out, because no axis moves in them as far as the control's decimals show
    coordinates : what the words are
    language : ``blocks`` of a control, or ``apt`` or ``points`` for a list of cutter locations
    findings : what was assumed, and what the control does otherwise than it was planned
    """

    control: str
    suffix: str
    lines: tuple[str, ...]
    rows: tuple[int, ...]
    dropped: int
    coordinates: Coordinates = "axes"
    language: str = "blocks"
    findings: tuple[Finding, ...] = ()

    @property
    def text(self) -> str:
        """The file's content; the same motion gives the same bytes."""
        return "\n".join(self.lines) + "\n"


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
    motion: Motion | ProgramMotion,
    *,
    machine: Machine,
    control: str | Path = "linuxcnc",
    coordinates: Coordinates | None = None,
    header: Header | None = None,
    winding: Winding = "unwound",
    settings: ProgramSettings | None = None,
    verdict: Sequence[tuple[str, str]] = NOT_VERIFIED,
    beyond: bool = False,
) -> Program:
    """Write the text of a program: nothing is verified here, and no blocks are inserted.

    `fiveaxis.job.make_program` is what plans a program's motion, writes it with this function, reads it back
    and verifies that.

    Rotary words are the motion's own angles in the control's sign, so that the machine does what was
    optimised; only directions of the tool leave them to the control. Every move is one block that moves all
    axes in proportion and takes the motion's time: F is the inverse of it, or the tip's speed along its path.

    The approach has no duration: the rotary axes turn where the tool is, then the linear axes move.

    Parameters
    ----------
    motion : axis values and durations; around a bare motion come the usual approach and leads
        (`ProgramMotion.around`), and one that was read from a program keeps its own end
    machine : whose axes they are
    control : a key of `DIALECTS`, or the path of a table of one's own (``.toml``)
    coordinates : ``axes``, positions of the machine's axes; ``tip``, the tool's tip on the workpiece and the
        rotary angles (TCP); ``vector``, the tip and the tool's direction. By default the first of them that
        the control has
    header : name and value of further comments, in order: tool, source, energy
    winding : how rotary axes of more than one turn are counted: ``unwound``, on and on; ``modulo``, from 0 to
        360, moves of half a turn or more cut into parts; ``rezero``, named anew by whole turns where a link
        begins. Which of them a control has, and what it needs for it, stands in `DIALECTS`
    settings : tool, spindle, coolant, work offset and so on; the header says what isn't written
    verdict : what the header says of verification, names and texts
    beyond : whether places beyond an axis's travel are written, too

    Raises
    ------
    SettingError
        An unknown control; coordinates, a winding or settings that the control or the machine hasn't.
    MachineError
        The motion has other axes than the machine, or the machine axes that the control doesn't know.
    ToolpathError
        No location; a value that isn't finite; an axis beyond its travel; a feed that isn't positive or that
        the control doesn't read; a move that takes no time.
    """
    settings = settings or ProgramSettings()
    wording = require_program(machine, control, coordinates, winding, settings)
    planned = motion if isinstance(motion, ProgramMotion) else _with_usual_leads(motion, wording, settings)
    if not beyond:
        _require_travel(planned.blocks, machine)
    pairs = [*(header.items() if isinstance(header, Mapping) else header or ()), *verdict]
    if wording.dialect.language == "blocks":
        return _program_of_blocks(planned, Frame(wording, settings, winding), pairs)
    head = head_lines(wording, settings, pairs, winding)
    lines = tuple(location_lines(planned.blocks, wording, head))
    rows = (NO_ROW,) * len(lines)
    dialect = wording.dialect
    return Program(dialect.name, dialect.suffix, lines, rows, 0, wording.coordinates, dialect.language)


def require_motion(motion: Motion, machine: Machine) -> None:
    """Refuse a motion of other axes, or with places that are no numbers, before anything is made of it.

    Raises
    ------
    MachineError, ToolpathError
        As `compose_program`.
    """
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}, and machine {machine.name!r} has {machine.letters}"
        )
    _require_numbers(motion)


def _with_usual_leads(motion: Motion, wording: Wording, settings: ProgramSettings) -> ProgramMotion:
    require_motion(motion, wording.machine)
    # A program that was read ends where its author let it end: its last feed moves may well lead out.
    stays = not settings.way_out or isinstance(motion, ReadMotion)
    none = np.zeros(len(motion.letters))
    return ProgramMotion.around(
        motion, wording.machine, wording.interpolation, lead_out=none if stays else None
    )


def _program_of_blocks(planned: ProgramMotion, frame: Frame, pairs: Sequence[tuple[str, str]]) -> Program:
    """Put a program together: what stands around the moves, the header, and the moves.

    Parameters
    ----------
    pairs : name and value of the header's comments
    """
    wording, dialect = frame.wording, frame.wording.dialect
    assumed = frame.assumptions()
    said = [*pairs, *_said_of_end(planned), *(("assumed", text) for text in assumed)]
    blocks = block_lines(planned.blocks, wording, frame.winding)
    head = [*frame.head(), *head_lines(wording, frame.settings, said, frame.winding), *frame.modes()]
    tagged = [
        *((line, NO_ROW) for line in head),
        *frame.approach(planned),
        *((line, row + planned.first) for line, row in zip(blocks.lines, blocks.rows, strict=True)),
        *frame.lead_out(planned),
        *((line, NO_ROW) for line in frame.end()),
    ]
    lines = tuple(numbered([line for line, _ in tagged], wording, frame.settings.line_numbers))
    _require_width(lines, wording)
    findings = (*(Finding(Severity.WARNING, "number-assumed", text) for text in assumed), *blocks.findings)
    return Program(
        control=dialect.name,
        suffix=dialect.suffix,
        lines=lines,
        rows=tuple(row for _, row in tagged),
        dropped=blocks.dropped,
        coordinates=wording.coordinates,
        findings=findings,
    )


def _said_of_end(planned: ProgramMotion) -> list[tuple[str, str]]:
    """Say in the header how the program leaves a last cut."""
    length = float(np.linalg.norm(planned.lead_out))
    if length <= STANDSTILL:
        return []
    return [("lead out", f"the program leads the tool {length:.3g} mm off its last cut, at the cut's feed")]


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
