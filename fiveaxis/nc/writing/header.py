"""The header's comments: what the program was made for, and what it requires at the machine."""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fiveaxis.machine import Machine, Setup
from fiveaxis.nc.own_header import control_comment, modulo_comment, positions_comment
from fiveaxis.nc.words import control_value
from fiveaxis.nc.writing.program_settings import ProgramSettings
from fiveaxis.nc.writing.table_parts import Comments
from fiveaxis.nc.writing.turns import counted_columns
from fiveaxis.nc.writing.wording import Wording

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
    wording: Wording, settings: ProgramSettings, pairs: Sequence[tuple[str, str]], winding: str
) -> list[str]:
    """Write the header's comments.

    Parameters
    ----------
    pairs : name and value of the caller's comments: tool, source, energy, verdict
    """
    machine = wording.machine
    texts = [
        f"machine: {machine.name}, form-shaping code {machine.code}",
        *_read_back(wording, winding),
        *(f"{name.replace(',', ' ')}: {value}" for name, value in pairs),
        *(note.text for note in machine_notes(wording, settings, winding)),
    ]
    return [line for text in texts for line in comment_lines(text, wording.dialect.comment)]


class Note(NamedTuple):
    """What a program requires at the machine.

    Parameters
    ----------
    about : ``start``, ``work offset``, ``tool`` or ``control``
    text : a sentence
    """

    about: str
    text: str


def machine_notes(wording: Wording, settings: ProgramSettings, winding: str) -> list[Note]:
    """List what a program requires at the machine, in the header's order."""
    return [Note(about, text) for about, texts in _notes(wording, settings, winding) for text in texts]


def _notes(wording: Wording, settings: ProgramSettings, winding: str) -> Iterator[tuple[str, Sequence[str]]]:
    dialect, is_program = wording.dialect, wording.dialect.language == "blocks"
    yield "control", [*dialect.notes, *wording.mode.notes]
    yield "control", [VECTOR_NOTE] if wording.coordinates == "vector" and is_program else []
    yield "start", _missing_note(settings, wording)
    if is_program:
        straight = f"rapid moves are taken to run straight, all axes arriving together: {dialect.straight}"
        yield "control", _winding_note(wording, winding)
        yield "work offset", [_zero_note(wording), *_setup_note(wording)]
        yield "start", _clamped_notes(wording.machine)
        yield "tool", [_length_note(wording)]
        yield "control", [straight]
        yield "start", [_start_note(wording)]
        yield "control", _sign_note(wording)


def contains_length(machine: Machine) -> bool:
    """Check whether the axis positions already contain the tool's length."""
    return not machine.length_is_along_z or machine.tool_length > 0.0


def _zero_note(wording: Wording) -> str:
    machine = wording.machine
    if wording.coordinates != "axes":
        return "zero: the work offset is the workpiece origin, with every axis at 0"
    home = " ".join(f"{a.letter}0" for a in machine.axes)
    x, y, z = np.round(machine.chain.tool_home[:3, 3], 6) + 0.0
    where = "at the workpiece origin" if x == y == z == 0.0 else f"at {x:g} {y:g} {z:g} mm of the workpiece"
    return f"zero: at {home} of the work offset the tool tip is {where}, as in the machine model"


def _read_back(wording: Wording, winding: str) -> Iterator[str]:
    """Yield the comments that the readers of programs look for."""
    machine, dialect = wording.machine, wording.dialect
    yield control_comment(dialect.name, wording.coordinates)
    letters = "".join(machine.letters[c] for c in counted_columns(machine))
    if winding == "modulo" and dialect.modulo is not None and letters:
        yield modulo_comment(dialect.modulo.way, letters)
    if wording.coordinates == "tip" and any(letter in "ABC" for letter in machine.code.table):
        yield positions_comment(wording.mode.positions)


def _winding_note(wording: Wording, winding: str) -> list[str]:
    """Return the control's note for the operator, if an axis has turns to count."""
    notes = wording.dialect.winding_notes
    return [notes[winding]] if winding in notes and counted_columns(wording.machine) else []


def _missing_note(settings: ProgramSettings, wording: Wording) -> list[str]:
    missing, kept = settings.missing, wording.mode.off_clear
    if wording.dialect.language != "blocks":
        return []
    notes = [f"not written: {', '.join(missing)}; see to it before the start"] if missing else []
    if kept and not settings.goes_clear:
        notes.append(
            f"not written: {' '.join(kept)} at the end, as it may move Z by the tool's length and no retract "
            "comes before it; see to it where the tool is clear"
        )
    return notes


def _setup_note(wording: Wording) -> list[str]:
    setup = wording.machine.setup
    if setup == Setup():
        return []
    turned = wording.coordinates != "axes" and not np.allclose(setup.frame[:3, :3], np.eye(3), atol=1e-12)
    note = "; the work offset must be turned like it" if turned else ""
    return [f"setup: workpiece at {setup} in the machine frame{note}"]


def _clamped_notes(machine: Machine) -> list[str]:
    return [
        f"clamped: {axis.letter} at {control_value(axis, value):g} {axis.unit}; these words hold there only"
        for axis, value in machine.clamped
    ]


def _length_note(wording: Wording) -> str:
    machine = wording.machine
    if wording.coordinates != "axes":
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


def _start_note(wording: Wording) -> str:
    then = "then X and Y move, then Z" if wording.coordinates == "axes" else "then X, Y and Z move together"
    return f"start with the tool clear of part and table: first the rotary axes turn, {then}"


def _sign_note(wording: Wording) -> list[str]:
    flipped = [
        a.letter
        for a in wording.machine.axes
        if a.reversed and (a.is_rotary or wording.coordinates == "axes")
    ]
    if not flipped or wording.coordinates == "vector":
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
