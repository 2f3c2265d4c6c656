"""Drafting a commented machine file from its owner's answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fiveaxis.errors import FigureError, SettingError
from fiveaxis.machine.answers import (
    BY_NAME,
    QUESTIONS,
    ROTARY,
    Answers,
    read_structure,
)
from fiveaxis.machine.building import build_machine
from fiveaxis.machine.code import AXIS_ORDER, parse_code
from fiveaxis.machine.dump import machine_document, neat, toml_text, without_defaults
from fiveaxis.machine.measuring import dimensions, draw, zero_of
from fiveaxis.machine.model import Machine
from fiveaxis.machine.tables import AxisTable, MachineFile
from fiveaxis.settings import explain

OWNER = "stated by the machine's owner"
DEFAULT_NAME = "my-machine"
# What a table says, above it in the file; `{axis}` is the axis's letter.
MEANINGS = {
    "structure": "Order of the axes, from the workpiece (first digit of the code) to the tool; 0 is the bed.",
    "spindle": "Gauge point of the spindle, where a tool of length 0 has its tip, with every axis at 0, mm.",
    "vertical": "Direction that is up: the axis along it lifts the weight that it moves.",
    "base_power": "Power at standstill, with everything switched on.",
    "size": "Size of the machine, from which masses that aren't stated are estimated.",
    "limits": "Travel of {axis}, as the tool moves relative to the workpiece.",
    "line": "Line about which {axis} turns: its direction, and a point on it in mm, with every axis at 0.",
    "max_speed": "Highest speed of {axis}.",
    "max_acceleration": "Highest acceleration of {axis}.",
    "moved_mass": "Mass that {axis} moves, without workpiece and fixture; its power is estimated from it.",
    "motor": "Nameplate of the motor of {axis}, from which its power is estimated.",
    "drive": "Power of the drive of {axis}.",
}
# What a missing table of an axis leaves undone.
WITHOUT = {
    "limits": "its travel isn't checked, and a rotary axis counts as endless",
    "max_speed": "speeds aren't checked, and times are too short",
    "max_acceleration": "accelerations aren't checked",
}
UNSURE = "the numbers are stated, the sense in which {axis} counts isn't: taken as tool relative to workpiece"
KIND_NOTE = (
    "the order of the linear axes is that of {kind}, not of this machine; it decides which masses an axis "
    "moves, not how the tool moves"
)
UPRIGHT = "not stated; Z is vertical on most machines"
INCLINED = "the direction of {kind}: 45 deg in this sense; not measured"

Table = dict[str, Any]


@dataclass(frozen=True)
class Draft:
    """A machine file that isn't written yet.

    Parameters
    ----------
    text : TOML, with comments
    machine : that it describes
    """

    text: str
    machine: Machine


def draft_machine(answers: Answers, base: Machine | None = None) -> Draft:
    """Draft a machine file from answers; the same answers give the same text.

    Parameters
    ----------
    answers : texts, by question (`QUESTIONS`) and axis letter; what has none is left out and said
    base : machine read from another program's file, whose figures stand where no answer is given

    Returns
    -------
    The draft; `check_text` finds what is unlikely in it.

    Raises
    ------
    SettingError
        An answer has another form, isn't plausible, is about an axis that the machine lacks, or contradicts
        another one; or there is neither a structure nor a base.
    """
    document = _document(answers, base)
    try:
        machine = build_machine(MachineFile.model_validate(document), Path())
    except ValidationError as fault:
        raise SettingError(explain(fault, MachineFile, document)) from None
    except FigureError as fault:
        raise SettingError(fault.message) from None
    return Draft("\n".join(_lines(document, machine, answers)), machine)


def known_letters(answers: Answers, base: Machine | None) -> str:
    """Return the letters of the axes, in the order of columns.

    Raises
    ------
    SettingError
        There is neither a structure nor a base.
    """
    if ("structure", "") in answers:
        code = str(BY_NAME["structure"].table("", answers["structure", ""])["code"])
    elif base is not None:
        code = base.code.text
    else:
        raise SettingError(
            "structure is missing: write a kind or a form-shaping code, for example trunnion-ac"
        )
    return "".join(sorted(parse_code(code).letters, key=AXIS_ORDER.index))


def _document(answers: Answers, base: Machine | None) -> Table:
    letters = known_letters(answers, base)
    _require_asked(answers, letters)
    document = _given(answers) if base is None else without_defaults(machine_document(base))
    if base is not None and ("structure", "") in answers:
        raise SettingError(f"structure: {base.name} has code {base.code}; leave the structure out")
    for letter in letters:
        document["axes"].setdefault(letter, {})
    document["name"] = answers.get(("name", ""), document["name"])
    for question in QUESTIONS:
        for letter in question.axes or ("",):
            answer = answers.get((question.name, letter))
            if answer is not None and question.key:
                place = document["axes"][letter] if letter else document
                stated = question.table(letter, answer) | {"source": OWNER}
                place[question.key] = _merged(question.key, place.get(question.key, {}), stated)
    if "vertical" not in document:
        document["vertical"] = {"direction": [0, 0, 1], "assumed": True, "note": UPRIGHT}
    for letter in letters:
        if letter in ROTARY:
            _settle_sense(document["axes"][letter], letter, answers, base)
    _require_consistent(document, sure=base is None and not document["structure"].get("assumed", False))
    return document


def _merged(key: str, known: Table, stated: Table) -> Table:
    """Put what an answer states in the place of a table, of which it states all or a part."""
    if key == "size":
        return {k: v for k, v in known.items() if k in ("kind", "mass")} | stated
    if key != "line" or "direction" not in known:
        return stated
    # A point doesn't say which way its line runs.
    kept = {k: known[k] for k in ("direction", "assumed", "note") if k in known}
    return {"note": f"its direction: {known.get('source', '')}"} | kept | stated


def _given(answers: Answers) -> Table:
    """Begin the document of a machine whose structure is a kind or a code."""
    answer = answers["structure", ""]
    code, kind = read_structure(answer)
    parsed = parse_code(code)
    structure: Table = {"source": OWNER}
    text = f"{parsed.kind} machine"
    if kind is not None:
        structure |= {"assumed": True, "note": KIND_NOTE.format(kind=answer)}
        text = kind.text
    axes: Table = {
        c: {"carries": "workpiece" if c in parsed.table else "tool"}
        for c in sorted(parsed.letters, key=AXIS_ORDER.index)
    }
    for letter, direction in () if kind is None else kind.inclined:
        note = INCLINED.format(kind=answer)
        axes[letter]["line"] = {"direction": [neat(v) for v in direction], "assumed": True, "note": note}
    description = f"{text}, as {OWNER}"
    return {
        "name": DEFAULT_NAME,
        "code": code,
        "description": description,
        "structure": structure,
        "axes": axes,
    }


def _settle_sense(table: Table, letter: str, answers: Answers, base: Machine | None) -> None:
    """Turn limits into those of the tool relative to the workpiece, or mark their sense as assumed."""
    counts = answers.get(("counts", letter))
    if base is not None:
        if counts is not None:
            raise SettingError(f"counts of {letter}: {base.name} has its sense; change it in the file")
        counts = "table" if table.get("reversed") else "tool"
    if counts is not None:
        table["reversed"] = BY_NAME["counts"].table(letter, counts)["reversed"]
    if ("limits", letter) not in answers:
        return
    limits = table["limits"]
    if counts is None:
        limits |= {"assumed": True, "note": UNSURE.format(axis=letter)}
    elif table["reversed"] and "min" in limits:
        low, high = limits["min"], limits["max"]
        note = f"{answers['limits', letter]} in the control's own sign"
        limits |= {"min": 0 - high, "max": 0 - low, "note": note}


def _require_asked(answers: Answers, letters: str) -> None:
    for name, letter in answers:
        if letter and letter not in letters:
            raise SettingError(f"{name} of {letter}: the machine has the axes {', '.join(letters)}")
        if letter not in (BY_NAME[name].axes or ("",)):
            raise SettingError(f"{name} of {letter}: it is asked of {', '.join(BY_NAME[name].axes)} only")
        BY_NAME[name].table(letter, answers[name, letter])


def _require_consistent(document: Table, *, sure: bool) -> None:
    """Raise if an axis moves more than the whole machine has, or less than an axis that it carries.

    Parameters
    ----------
    sure : whether the order of the linear axes is that of the machine
    """
    masses = {c: t["moved_mass"]["value"] for c, t in document["axes"].items() if "moved_mass" in t}
    whole = document.get("size", {}).get("mass")
    for letter, mass in masses.items():
        if whole is not None and mass >= whole:
            raise SettingError(
                f"masses of {letter}: it moves {mass:g} kg, and the whole machine has {whole:g} kg; correct "
                "one of them"
            )
    code = parse_code(document["code"])
    for side in (code.table, code.head[::-1]):
        known = [c for c in side if c in masses and (sure or c in ROTARY)]
        for carried, carrying in pairwise(known):
            if masses[carrying] < masses[carried]:
                raise SettingError(
                    f"masses of {carrying}: it moves {masses[carrying]:g} kg, less than {carried}, which it "
                    f"carries and which moves {masses[carried]:g} kg; count all that an axis moves"
                )


def _lines(document: Table, machine: Machine, answers: Answers) -> Iterator[str]:
    """Write the document table by table, each below its meaning, with what is missing in comments."""
    head: Table = {key: document[key] for key in ("name", "code", "description") if key in document}
    yield "# Written by `fiveaxis machine new`. Values are those of the tool relative to the workpiece;"
    yield f"# zero of the machine frame is {zero_of(machine)}, every axis at 0."
    if ("control", "") in answers:
        yield f'# Control: jobs for this machine have control = "{answers["control", ""]}".'
    yield toml_text(head)
    yield from _pivots(machine)
    for key in MachineFile.model_fields:
        if key in document and key not in (*head, "axes", "bodies"):
            yield from _table((key,), document[key], MEANINGS.get(key, ""))
    if "spindle" not in document and not dimensions(machine) and machine.code.table:
        yield "# spindle: not given; its gauge point is taken to be at zero with every axis at 0.\n"
    if "base_power" not in document:
        yield "# base_power: not given; the energy of the machine at standstill isn't counted.\n"
    for letter, axis in document["axes"].items():
        yield from _axis(letter, axis)
    if document.get("bodies"):
        yield toml_text({"bodies": document["bodies"]})
    else:
        yield "# bodies: not given; collisions with the machine itself aren't checked."
    yield ""


def _pivots(machine: Machine) -> Iterator[str]:
    missing = dimensions(machine)
    if missing:
        yield "# Pivots: not all given. Measure, with every axis at 0, and write:"
        yield from (f"#   {dimension}" for dimension in missing)
        yield from (f"# {line}".rstrip() for line in draw(machine).splitlines())
        yield ""


def _axis(letter: str, axis: Table) -> Iterator[str]:
    plain = {key: value for key, value in axis.items() if not isinstance(value, Mapping)}
    yield f"# Axis {letter}."
    for key, lack in WITHOUT.items():
        if key not in axis:
            yield f"# {key}: not given; {lack}."
    if not {"moved_mass", "motor", "drive"} & set(axis):
        yield "# moved_mass, motor: not given; the power is estimated from the machine's size, roughly."
    yield toml_text({"axes": {letter: plain}})
    for key in AxisTable.model_fields:
        if isinstance(axis.get(key), Mapping):
            yield from _table(("axes", letter, key), axis[key], MEANINGS.get(key, "").format(axis=letter))


def _table(where: tuple[str, ...], table: Table, meaning: str) -> Iterator[str]:
    nested: Table = table
    for key in reversed(where):
        nested = {key: nested}
    if meaning:
        yield f"# {meaning}"
    yield toml_text(nested)
