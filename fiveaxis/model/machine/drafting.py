"""Drafting a commented machine file from its owner's answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from pydantic import BaseModel, ValidationError

from fiveaxis.base import FigureError, SettingError, explain
from fiveaxis.model.machine.answers import BY_NAME, QUESTIONS, Answers, read_structure
from fiveaxis.model.machine.axis_tables import POWERED, AxisTable
from fiveaxis.model.machine.building import (
    UNSETTLED,
    build_machine,
    machine_document,
    toml_text,
    without_defaults,
)
from fiveaxis.model.machine.code import AXIS_ORDER, parse_code
from fiveaxis.model.machine.figures import ROTARY, Table, figure_models, meaning_of, neat
from fiveaxis.model.machine.measuring import dimensions, draw, zero_of
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.provenance import Provenance
from fiveaxis.model.machine.tables import MachineFile
from fiveaxis.model.machine.unknown import ASSUMED

OWNER = "stated by the machine's owner"
BY_OWNER: Table = {"source": OWNER}
AT_GAUGE = "the zero of the machine frame is chosen at the gauge point, every axis at 0"
BY_CALLER: Table = {"assumed": True, "note": f"{ASSUMED} (--assume)"}
DEFAULT_NAME = "my-machine"
UNSURE = "the numbers are stated, the sense in which {axis} counts isn't: taken as tool relative to workpiece"
KIND_NOTE = (
    "the order of the linear axes is that of {kind}, not of this machine; it decides which masses an axis "
    "moves, not how the tool moves"
)
UPRIGHT = "not stated; Z is vertical on most machines"
INCLINED = "the direction of {kind}: 45 deg in this sense; not measured"


@dataclass(frozen=True)
class Draft:
    """A machine file that isn't written yet: TOML with comments, and the machine that it describes."""

    text: str
    machine: Machine


def draft_machine(answers: Answers, base: Machine | None = None) -> Draft:
    """Draft a machine file from answers; the same answers give the same text.

    Parameters
    ----------
    answers : texts, by question (`QUESTIONS`) and axis letter; what has none is left out and said
    base : machine read from another program's file, whose figures stand where no answer is given

    Raises
    ------
    SettingError
        An answer has another form, isn't plausible, is about an axis that the machine lacks, or contradicts
        another one; or there is neither a structure nor a base.
    """
    document = _document(answers, base)
    machine = _built(document)
    _require_consistent(machine, sure=base is None and not document["structure"].get("assumed", False))
    return Draft("\n".join(_lines(document, machine, answers)), machine)


def known_letters(answers: Answers, base: Machine | None) -> str:
    """Return the letters of the axes, in the order of columns; of a structure, or else of a base."""
    if ("structure", "") in answers:
        code = str(BY_NAME["structure"].table("", answers["structure", ""])["code"])
    elif base is not None:
        code = base.code.text
    else:
        raise SettingError(
            "structure is missing: write a kind or a form-shaping code, for example trunnion-ac"
        )
    return "".join(sorted(parse_code(code).letters, key=AXIS_ORDER.index))


def assuming(machine: Machine, assumptions: Mapping[str, str]) -> Machine:
    """Return a machine, without setup and tool, with figures that are assumed for one run, and marked so.

    Assumptions are answers to questions of `fiveaxis machine new`, by name: ``A.points``: ``0,0,50``,
    ``B.counts``: ``table``, ``base-power``: ``600 W``. `SettingError` for an unknown name, or an answer as
    for `draft_machine`.
    """
    answers = {}
    for name, answer in assumptions.items():
        letter, dot, question = name.rpartition(".")
        known = BY_NAME.get(question)
        if known is None or not (known.key or question == "counts"):
            names = ", ".join(f"AXIS.{q.name}" if q.axes else q.name for q in QUESTIONS if q.key)
            raise SettingError(f"assume: {name!r} is no figure of a machine; there are AXIS.counts, {names}")
        if bool(dot) is not bool(known.axes):
            form = f"AXIS.{question}" if known.axes else question
            raise SettingError(f"assume: {name!r}: write {form}={answer}")
        answers[question, letter.upper()] = answer
    made = _built(_document(answers, machine, BY_CALLER))
    # In which sense an axis counts is no figure with an origin of its own.
    senses = [
        Provenance(f"{letter} counts", answer, "", assumed=True, note=str(BY_CALLER["note"]))
        for (question, letter), answer in answers.items()
        if question == "counts"
    ]
    return replace(made, provenance=(*made.provenance, *senses))


def _built(document: Table) -> Machine:
    try:
        return build_machine(MachineFile.model_validate(document), Path())
    except ValidationError as fault:
        raise SettingError(explain(fault, MachineFile, document)) from None
    except FigureError as fault:
        raise SettingError(fault.message) from None


def _document(answers: Answers, base: Machine | None, origin: Table = BY_OWNER) -> Table:
    letters = known_letters(answers, base)
    _require_asked(answers, letters)
    document = _given(answers) if base is None else without_defaults(machine_document(base))
    if base is not None and ("structure", "") in answers:
        raise SettingError(f"structure: {base.name} has code {base.code}; leave the structure out")
    for letter in letters:
        document["axes"].setdefault(letter, {})
    document["name"] = answers.get(("name", ""), document["name"])
    if ("control", "") in answers:
        document["control"] = answers["control", ""]
    for question in QUESTIONS:
        for letter in question.axes or ("",):
            answer = answers.get((question.name, letter))
            if answer is not None and question.key:
                place = document["axes"][letter] if letter else document
                stated = question.table(letter, answer) | origin
                place[question.key] = _merged(question.key, place.get(question.key, {}), stated)
    if "vertical" not in document:
        document["vertical"] = {"direction": [0, 0, 1], "assumed": True, "note": UPRIGHT}
    for letter in letters:
        if letter in ROTARY:
            _settle_sense(document["axes"][letter], letter, answers, base)
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
    given = {
        "name": DEFAULT_NAME,
        "code": code,
        "description": description,
        "structure": structure,
        "axes": axes,
    }
    table, head = (any(c in ROTARY for c in side) for side in (parsed.table, parsed.head))
    if head and not table:
        given["spindle"] = {"point": [0.0, 0.0, 0.0], "source": AT_GAUGE}
    return given


def _settle_sense(table: Table, letter: str, answers: Answers, base: Machine | None) -> None:
    """Turn limits into those of the tool relative to the workpiece, or mark their sense as assumed."""
    counts = answers.get(("counts", letter))
    settled = base is not None and base.axis(letter).reversed is not None
    if base is not None and settled:
        if counts is not None:
            raise SettingError(f"counts of {letter}: {base.name} has its sense; change it in the file")
        counts = "table" if table.get("reversed") else "tool"
    table["reversed"] = UNSETTLED
    if counts is not None:
        table["reversed"] = BY_NAME["counts"].table(letter, counts)["reversed"]
    limits, stated = table.get("limits"), ("limits", letter) in answers
    # Ends that a file states of an axis whose sense isn't settled are in the control's own sign, too.
    if limits is None or (settled and not stated):
        return
    if counts is None:
        limits |= {"assumed": True, "note": UNSURE.format(axis=letter)} if stated else {}
    elif table["reversed"] and not {"min", "max"}.isdisjoint(limits):
        low, high = limits.get("min"), limits.get("max")
        own = ":".join("" if end is None else f"{end:g}" for end in (low, high))
        limits["note"] = f"{answers.get(('limits', letter), own)} in the control's own sign"
        for end, opposite in (("min", high), ("max", low)):
            if opposite is not None:
                limits[end] = 0 - opposite
            else:
                limits.pop(end, None)


def _require_asked(answers: Answers, letters: str) -> None:
    for name, letter in answers:
        if letter and letter not in letters:
            raise SettingError(f"{name} of {letter}: the machine has the axes {', '.join(letters)}")
        if letter not in (BY_NAME[name].axes or ("",)):
            raise SettingError(f"{name} of {letter}: it is asked of {', '.join(BY_NAME[name].axes)} only")
        BY_NAME[name].table(letter, answers[name, letter])


def _require_consistent(machine: Machine, *, sure: bool) -> None:
    """Raise if an axis moves more than the whole machine has, or less than an axis that it carries.

    `sure` is whether the order of the linear axes is that of the machine.
    """
    for axis in machine.axes:
        share = machine.size.explain_share(axis.moved_mass)
        if share is not None:
            raise SettingError(f"masses of {axis.letter}: it {share}")
    masses = {a.letter: a.moved_mass for a in machine.axes if a.moved_mass is not None}
    for side in (machine.code.table, machine.code.head[::-1]):
        known = [c for c in side if c in masses and (sure or c in ROTARY)]
        for carried, carrying in pairwise(known):
            if masses[carrying] < masses[carried]:
                raise SettingError(
                    f"masses of {carrying}: it moves {masses[carrying]:g} kg, less than {carried}, which it "
                    f"carries and which moves {masses[carried]:g} kg; count all that an axis moves"
                )


def _lines(document: Table, machine: Machine, answers: Answers) -> Iterator[str]:
    """Write the document table by table, each below its meaning, with what is missing in comments."""
    head: Table = {
        key: document[key] for key in ("name", "code", "description", "control") if key in document
    }
    yield "# Written by `fiveaxis machine new`. Values are those of the tool relative to the workpiece;"
    yield f"# zero of the machine frame is {zero_of(machine)}, every axis at 0."
    yield toml_text(head)
    yield from _pivots(machine)
    for key in figure_models(MachineFile):
        if key in document:
            yield from _table((key,), document[key], meaning_of(MachineFile, key, ""))
    if "spindle" not in document and not dimensions(machine) and machine.code.table:
        yield "# spindle: not given; its gauge point is taken to be at zero with every axis at 0.\n"
    yield from (f"{line}\n" for line in _lacking(MachineFile, document))
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
    yield from _lacking(AxisTable, axis)
    if not set(POWERED) & set(axis):
        yield "# moved_mass, motor: not given; the power is estimated from the machine's size, roughly."
    yield toml_text({"axes": {letter: plain}})
    for key in figure_models(AxisTable):
        if key in axis:
            yield from _table(("axes", letter, key), axis[key], meaning_of(AxisTable, key, letter))


def _lacking(tables: type[BaseModel], given: Table) -> Iterator[str]:
    """Say which figures aren't given, and what the machine then does without."""
    for key, [model, *_] in figure_models(tables).items():
        if model.lack and key not in given:
            yield f"# {key}: not given; {model.lack}."


def _table(where: tuple[str, ...], table: Table, meaning: str) -> Iterator[str]:
    nested: Table = table
    for key in reversed(where):
        nested = {key: nested}
    yield f"# {meaning}"
    yield toml_text(nested)
