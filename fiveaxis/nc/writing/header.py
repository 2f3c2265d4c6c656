"""The header's comments: what the program was made for, and what it requires at the machine."""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fiveaxis.machine import Machine, Setup
from fiveaxis.machine.unknown import assumed_figures
from fiveaxis.nc.own_header import control_comment, modulo_comment, positions_comment, setup_comment
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


def head_lines(
    writer: WordWriter, settings: ProgramSettings, pairs: Sequence[tuple[str, str]], winding: str
) -> list[str]:
    """Write the header's comments.

    Parameters
    ----------
    pairs : name and value of the caller's comments: tool, source, energy, verdict
    """
    machine = writer.machine
    texts = [
        f"machine: {machine.name}, form-shaping code {machine.code}",
        *_read_back(writer, winding),
        *(f"{name.replace(',', ' ')}: {value}" for name, value in pairs),
        *(note.text for note in machine_notes(writer, settings, winding)),
    ]
    return [line for text in texts for line in comment_lines(text, writer.dialect.comment)]


class Note(NamedTuple):
    """What a program requires at the machine.

    Parameters
    ----------
    about : ``start``, ``work offset``, ``tool`` or ``control``
    text : a sentence
    """

    about: str
    text: str


def machine_notes(writer: WordWriter, settings: ProgramSettings, winding: str) -> list[Note]:
    """List what a program requires at the machine, in the header's order."""
    return [Note(about, text) for about, texts in _notes(writer, settings, winding) for text in texts]


def _notes(
    writer: WordWriter, settings: ProgramSettings, winding: str
) -> Iterator[tuple[str, Sequence[str]]]:
    dialect, is_program = writer.dialect, writer.dialect.language == "blocks"
    yield "control", [*dialect.notes, *writer.mode.notes]
    yield "control", [VECTOR_NOTE] if writer.coordinates == "vector" and is_program else []
    for p in assumed_figures(writer.machine):
        yield "control", [f"assumed for this run: {p.figure}, {p.value}; measure it before the program runs"]
    yield "start", _missing_note(settings, writer)
    if is_program:
        straight = f"rapid moves are taken to run straight, all axes arriving together: {dialect.straight}"
        yield "control", _winding_note(writer, winding)
        yield "work offset", [_zero_note(writer), *_setup_note(writer)]
        yield "start", _clamped_notes(writer.machine)
        yield "tool", [_length_note(writer)]
        yield "control", [straight]
        yield "start", [_start_note(writer)]
        yield "control", _sign_note(writer)


def contains_length(machine: Machine) -> bool:
    """Check whether the axis positions already contain the tool's length."""
    return not machine.length_is_along_z or machine.tool_length > 0.0


def _zero_note(writer: WordWriter) -> str:
    machine = writer.machine
    if writer.coordinates != "axes":
        return "zero: the work offset is the workpiece origin, with every axis at 0"
    home = " ".join(f"{a.letter}0" for a in machine.axes)
    x, y, z = np.round(machine.chain.tool_home[:3, 3], 6) + 0.0
    where = "at the workpiece origin" if x == y == z == 0.0 else f"at {x:g} {y:g} {z:g} mm of the workpiece"
    return f"zero: at {home} of the work offset the tool tip is {where}, as in the machine model"


def _read_back(writer: WordWriter, winding: str) -> Iterator[str]:
    """Yield the comments that the readers of programs look for."""
    machine, dialect = writer.machine, writer.dialect
    yield control_comment(dialect.name, writer.coordinates)
    letters = "".join(machine.letters[c] for c in counted_columns(machine))
    if winding == "modulo" and dialect.modulo is not None and letters:
        yield modulo_comment(dialect.modulo.way, letters)
    if writer.coordinates == "tip" and any(letter in "ABC" for letter in machine.code.table):
        yield positions_comment(writer.mode.positions)


def _winding_note(writer: WordWriter, winding: str) -> list[str]:
    """Return the control's note for the operator, if an axis has turns to count."""
    notes = writer.dialect.winding_notes
    return [notes[winding]] if winding in notes and counted_columns(writer.machine) else []


def _missing_note(settings: ProgramSettings, writer: WordWriter) -> list[str]:
    missing, kept = settings.missing, writer.mode.off_clear
    if writer.dialect.language != "blocks":
        return []
    notes = [f"not written: {', '.join(missing)}; see to it before the start"] if missing else []
    if kept and not settings.goes_clear:
        notes.append(
            f"not written: {' '.join(kept)} at the end, as it may move Z by the tool's length and no retract "
            "comes before it; see to it where the tool is clear"
        )
    return notes


def _setup_note(writer: WordWriter) -> list[str]:
    setup = writer.machine.setup
    if setup == Setup():
        return []
    turned = writer.coordinates != "axes" and not np.allclose(setup.frame[:3, :3], np.eye(3), atol=1e-12)
    note = "; the work offset must be turned like it" if turned else ""
    return [setup_comment(setup) + note]


def _clamped_notes(machine: Machine) -> list[str]:
    return [
        f"clamped: {axis.letter} at {control_value(axis, value):g} {axis.unit}; these words hold there only"
        for axis, value in machine.clamped
    ]


def _length_note(writer: WordWriter) -> str:
    machine = writer.machine
    if writer.coordinates != "axes":
        return (
            "tool length: words are the tip's, and the control adds the length of the loaded tool: measure it"
        )
    if not machine.length_is_along_z:
        return (
            f"tool length {machine.tool_length:g} mm: it isn't always along Z, so it is part of the machine "
            "model and the words hold for that tool only; the control adds none"
        )
    if machine.tool_length > 0.0:
        return f"tool length {machine.tool_length:g} mm is contained in the words; the control adds none"
    return "tool length: Z is the tool tip's; the control adds the length of the loaded tool, so measure it"


def _start_note(writer: WordWriter) -> str:
    above = "then X, Y and Z go to a point above the path, then Z comes down"
    then = "then X and Y move, then Z" if writer.coordinates == "axes" else above
    return f"start with the tool clear of part and table: first the rotary axes turn, {then}"


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
    (``MSG,...``) loses its comma; characters that end a program or continue a line become ``_``.
    """
    plain = " ".join(_ascii(text).split()).translate({ord(sign): "_" for sign in form.forbidden})
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
