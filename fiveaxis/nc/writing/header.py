"""The header's comments: what the program was made for, and what it requires at the machine."""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fiveaxis.model import Machine, Setup, assumed_figures
from fiveaxis.nc.own_header import CALLERS_READ_BACK, CONTROL, DEGREE, LENGTH, MODULO, POSITIONS, SETUP
from fiveaxis.nc.words import control_value
from fiveaxis.nc.writing.program_settings import ProgramSettings
from fiveaxis.nc.writing.table_parts import Comments
from fiveaxis.nc.writing.turns import counted_columns
from fiveaxis.nc.writing.word_writer import WordWriter

VECTOR_NOTE = (
    "directions of the tool are written, and the control chooses its rotary angles for them: they may be "
    "others than those that were optimised and verified"
)

# Brackets can't nest; the other characters have no ASCII decomposition in Unicode.
_TO_ASCII = str.maketrans(
    {
        "(": "[", ")": "]", "°": " deg", "·": "*", "×": "x", "−": "-", "–": "-", "—": "-", "→": "->",
        "µ": "u", "μ": "u", "ß": "ss", "ø": "o", "Ø": "d", "“": '"', "”": '"', "‘": "'", "’": "'",
    }
)  # fmt: skip


# Lines of the header; what is beyond them is in the report.
MOST_LINES = 17


def head_lines(
    writer: WordWriter,
    settings: ProgramSettings,
    verdict: Sequence[tuple[str, str]],
    pairs: Sequence[tuple[str, str]],
    winding: str,
    further: Sequence[str] = (),
) -> list[str]:
    """Write the header's comments: what is read back, the verdict, what the operator needs, the caller's.

    Verdict and pairs are names and values, of the caller's the most important ones first, as a long header
    is cut; further notes for the operator depend on the motion.
    """
    machine, form = writer.machine, writer.dialect.comment
    notes = [note.head for note in machine_notes(writer, settings, winding) if note.head]
    # What the readers of programs look for stays in any case.
    kept = [(name, value) for name, value in pairs if name in CALLERS_READ_BACK]
    rest = [(name, value) for name, value in pairs if name not in CALLERS_READ_BACK]
    before, after = ([f"{n.replace(',', ' ')}: {v}" for n, v in each] for each in ((*kept, *verdict), rest))
    texts = [f"machine: {machine.name}, form-shaping code {machine.code}", *_read_back(writer, winding)]
    lines = [line for text in (*texts, *before, *further, *notes) for line in comment_lines(text, form)]
    for text in after:
        added = comment_lines(text, form)
        if len(lines) + len(added) > MOST_LINES:
            return [*lines[: MOST_LINES - 1], *comment_lines("further comments are in the report", form)]
        lines += added
    return lines


class Note(NamedTuple):
    """What a program requires at the machine.

    Parameters
    ----------
    about : ``start``, ``work offset``, ``tool`` or ``control``
    text : a sentence
    head : the same in the few words of the program's header; empty where it doesn't say it
    """

    about: str
    text: str
    head: str = ""


def machine_notes(writer: WordWriter, settings: ProgramSettings, winding: str) -> Iterator[Note]:
    """List what a program requires at the machine."""
    dialect, machine = writer.dialect, writer.machine
    is_program, by_axes = dialect.language == "blocks", writer.coordinates == "axes"
    for text in (*dialect.notes, *writer.mode.notes):
        yield Note("control", text.replace("{linear}", str(dialect.number.linear)))
    if not is_program:
        return
    for p in assumed_figures(machine):
        text = f"assumed for this run: {p.figure}, {p.value}; measure it before the program runs"
        yield Note("control", text, f"assumed, measure it first: {p.figure}, {p.value}")
    if writer.coordinates == "vector":
        yield Note("control", VECTOR_NOTE, "angles: the control's choice, they may not be the verified ones")
    if settings.missing:
        todo = ", ".join(settings.missing)
        yield Note("start", f"before that the operator sees to {todo}", f"operator: {todo}")
    if writer.mode.off_clear and not settings.goes_clear:
        head = f"not written: {' '.join(writer.mode.off_clear)} at the end"
        why = "as it may move Z by the tool's length without a retract; see to it where the tool is clear"
        yield Note("start", f"{head}, {why}", head)
    if (note := dialect.winding_notes.get(winding)) is not None and counted_columns(machine):
        yield Note("control", note, note)
    yield Note("work offset", *_zero_note(writer))
    for text in _setup_note(writer):
        yield Note("work offset", text, text.partition(";")[0])
    for text in _clamped_notes(machine):
        yield Note("start", text, text.partition(";")[0])
    yield Note("tool", *_length_note(writer))
    straight = f"rapid moves are taken to run straight, all axes arriving together: {dialect.straight}"
    yield Note("control", straight)
    then = "X and Y, then Z" if by_axes else "to straight above the path, then Z"
    yield Note("start", f"order: rotary axes, {then}", f"approach: rotary axes, {then}")
    yield from (Note("control", text) for text in _sign_note(writer))


def contains_length(machine: Machine) -> bool:
    """Check whether the axis positions already contain the tool's length."""
    return not machine.length_is_along_z or machine.tool_length > 0.0


def _zero_note(writer: WordWriter) -> tuple[str, str]:
    machine = writer.machine
    if writer.coordinates != "axes":
        text = "the work offset is the workpiece origin, with every axis at 0"
        return f"zero: {text}", "zero: the workpiece origin, every axis at 0"
    home = " ".join(f"{a.letter}0" for a in machine.axes)
    x, y, z = np.round(machine.chain.tool_home[:3, 3], 6) + 0.0
    where = "at the workpiece origin" if x == y == z == 0.0 else f"at {x:g} {y:g} {z:g} mm of the workpiece"
    text = f"zero: at {home} of the work offset the tool tip is {where}, as in the machine model"
    return text, f"zero: at {home} the tip is {where}"


def _read_back(writer: WordWriter, winding: str) -> Iterator[str]:
    """Yield the comments that the readers of programs look for."""
    machine, dialect = writer.machine, writer.dialect
    yield CONTROL.write(dialect.name, writer.coordinates)
    degree = dialect.mixed_feed.degree
    if writer.coordinates == "axes" and writer.mode.feed == "per_minute" and degree is not None:
        yield DEGREE.write(degree)
    letters = "".join(machine.letters[c] for c in counted_columns(machine))
    if winding == "modulo" and dialect.modulo is not None and letters:
        yield MODULO.write(dialect.modulo.way, letters)
    if writer.coordinates == "tip" and any(letter in "ABC" for letter in machine.code.table):
        yield POSITIONS.write(writer.mode.positions)


def _setup_note(writer: WordWriter) -> list[str]:
    setup = writer.machine.setup
    if setup == Setup():
        return []
    turned = writer.coordinates != "axes" and not np.allclose(setup.frame[:3, :3], np.eye(3), atol=1e-12)
    note = "; the work offset must be turned like it" if turned else ""
    return [SETUP.write(*setup.offset, *setup.rotation_deg) + note]


def _clamped_notes(machine: Machine) -> list[str]:
    return [
        f"clamped: {axis.letter} at {control_value(axis, value):g} {axis.unit}; these words hold there only"
        for axis, value in machine.clamped
    ]


def _length_note(writer: WordWriter) -> tuple[str, str]:
    machine = writer.machine
    adds = "the control adds the length of the loaded tool"
    head = "length: to the tip, the control adds that of the loaded tool"
    if writer.coordinates != "axes":
        return f"tool length: words are the tip's, and {adds}: measure it", head
    length = f"tool length {machine.tool_length:g} mm"
    contained = LENGTH.write(machine.tool_length)
    if not machine.length_is_along_z:
        text = f"{length}: it isn't always along Z, so it is part of the machine model and the words hold for"
        return f"{text} that tool only; the control adds none", contained
    if machine.tool_length > 0.0:
        text = f"{length} is contained in the words; the control adds none"
        return text, contained
    return f"tool length: Z is the tool tip's; {adds}, so measure it", head


def _sign_note(writer: WordWriter) -> list[str]:
    flipped = [
        a.letter for a in writer.machine.axes if a.reversed and (a.is_rotary or writer.coordinates == "axes")
    ]
    if not flipped or writer.coordinates == "vector":
        return []
    return [f"{' '.join(flipped)} count as on this control, opposite to tool relative to workpiece"]


def comment_lines(text: str, form: Comments) -> list[str]:
    """Write any text as comment blocks of a control.

    The text becomes ASCII (accents are dropped, unknown characters become ``?``), round brackets become
    square, line ends become spaces, and long texts are wrapped. A text that the control would act on
    (``MSG,...``) loses its comma; ``%``, where it ends a program, becomes words, and other characters that
    end a program or continue a line become ``_``.
    """
    plain = " ".join(_ascii(text).split())
    plain = plain.replace("%", "per cent") if "%" in form.forbidden else plain
    plain = plain.translate({ord(sign): "_" for sign in form.forbidden})
    plain = plain.upper() if form.capitals else plain
    wrapped = textwrap.wrap(plain, width=form.width, subsequent_indent="  ") or [""]
    return [form.template.format(_disarmed(line, form)) for line in wrapped]


def _ascii(text: str) -> str:
    decomposed = unicodedata.normalize("NFKD", text.translate(_TO_ASCII)).translate(_TO_ASCII)
    kept = "".join(c for c in decomposed if not unicodedata.combining(c))
    return "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in kept)


def _disarmed(line: str, form: Comments) -> str:
    word, comma, rest = line.partition(",")
    active = comma and word.strip().lower() in form.active
    return f"{word} {rest}" if active else line
