"""What a machinist asks first: is it safe, what does it save, what to do now.

The page, the JSON document and the terminal give the same answers, as lines of plain text.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from fiveaxis.base import Cause, Severity, group_gaps
from fiveaxis.nc import Preparation
from fiveaxis.posture import AS_PROGRAMMED
from fiveaxis.show.report.words import (
    NO_CHANGE,
    UNKNOWN,
    describe_cutter,
    number,
    plain,
    saving,
    speed_change,
    time_shares,
)

if TYPE_CHECKING:
    from fiveaxis.model import Energy
    from fiveaxis.show.report.document import ReportDocument

# Risks weren't checked: partial; nothing was: unknown; errors were accepted by name: overridden.
Verdict = Literal["safe", "partial", "unknown", "unsafe", "overridden"]

# Measure -> the boundary of its energy.
BOUNDARIES = {
    "with_base": "feed drives and base power over the cycle time",
    "total": "feed drives only",
}
LISTS = {"apt": "cutter locations", "points": "list of points"}


class Detail(NamedTuple):
    """A line below an answer: a word on what it is about, and a sentence."""

    about: str
    text: str


@dataclass(frozen=True)
class Answer:
    """An answer in one line, and what belongs to it.

    Parameters
    ----------
    question : as a machinist asks it
    text : the answer
    details : below it
    folded : what is shown only at a click, or with -v
    """

    question: str
    text: str
    details: tuple[Detail, ...] = ()
    folded: tuple[Detail, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the answer as plain data for JSON."""
        details = [detail._asdict() for detail in (*self.details, *self.folded)]
        return {"question": self.question, "text": self.text, "details": details}


@dataclass(frozen=True)
class Answers:
    """The three answers.

    Parameters
    ----------
    verdict : the first answer in a word
    safe, saved, next : whether the program is safe to run, what it saves, what to do now
    """

    verdict: Verdict
    safe: Answer
    saved: Answer
    next: Answer

    def as_dict(self) -> dict[str, Any]:
        """Return the answers as plain data for JSON."""
        return {"verdict": self.verdict} | {
            name: getattr(self, name).as_dict() for name in ("safe", "saved", "next")
        }


def answers(document: ReportDocument) -> Answers:
    """Answer the three questions; nothing is claimed beyond what was checked."""
    verdict = _verdict(document)
    return Answers(verdict, _is_safe(document, verdict), _saved(document, verdict), _next(document, verdict))


def _verdict(document: ReportDocument) -> Verdict:
    report = document.verdict
    if document.accepted:
        return "overridden"
    if not report.ok:
        return "unsafe"
    if not report.passed:
        return "unknown"
    return "partial" if report.risks else "safe"


def _is_safe(document: ReportDocument, verdict: Verdict) -> Answer:
    found = _found(document.summary)
    remarks = f", with {' and '.join(found)}" if found else ""
    text = {
        "overridden": "No: errors were found, and accepted by name.",
        "unsafe": "No: don’t run this program.",
        "safe": f"Yes: whatever could do harm was checked and passed{remarks}.",
        "partial": f"Only in part: no errors{remarks}, but not every risk was checked.",
        "unknown": "Unknown: nothing was checked.",
    }[verdict]
    report = document.verdict
    risks = _each("Risk", [f"{line}." for line in group_gaps(report.risks)])
    coded = _each("Found", [f"{', '.join(_found(document.summary, coded=True))}."] if found else [])
    folded = _each("Not asked for", [f"{gap.sentence}." for gap in report.not_asked])
    # Notes alone ask for nothing.
    if all(cause.severity is Severity.NOTE for cause in document.summary):
        coded, folded = (), (*coded, *folded)
    details = (*risks, *coded, *_judged(document), *_limits(document))
    return Answer("Is it safe to run?", text, details, folded)


def _judged(document: ReportDocument) -> Iterator[Detail]:
    if document.kept_back:
        yield Detail("Kept back", f"No NC program was written, because of {_codes(document.kept_back)}.")
    if document.overriding is not None and document.accepted:
        written = " The program was written with them, and its header names each."
        by = f"{_codes(document.accepted)}, by {document.overriding.by}."
        yield Detail("Overridden", by + ("" if document.kept_back else written))


def _saved(document: ReportDocument, verdict: Verdict) -> Answer:
    question, name = "What does it save?", document.baseline
    if name is None:
        time = f"{number(document.solution.energy.time, 1)} s{_bounded(document)}"
        text = f"Unknown: there is no baseline to compare with. It takes {time}."
        return Answer(question, text, folded=tuple(_steadiness(document)))
    energy, baseline = document.solution.energy, document.solution.baselines[name]
    own, other = (number(getattr(e, document.measure)) for e in (energy, baseline))
    which = "the program as it was" if name == AS_PROGRAMMED else f"the best baseline, {name}"
    compared = f"{own} J against {other} J of {which} ({BOUNDARIES[document.measure]})"
    text = f"{_share(document.saved(name, document.measure), 'energy')}: {compared}."
    unknown = document.solution.to_measure(name, with_base=document.measure == "with_base")
    if unknown:
        text = f"energy not known: {unknown}. By the estimates {compared}."
    events = [number(each.starts + each.reversals) for each in (energy, baseline)]
    time = _time_beside(energy, baseline, _bounded(document))
    text = f"{time}, {events[0]} starts and reversals against {events[1]}; {text}"
    if document.replaced_for:
        text = f"As it was, the program isn’t admitted ({', '.join(document.replaced_for)}): {text}"
    elif document.trades:
        text = f"A trade, as it is {' and '.join(document.trades)}: {text}"
    text = text[0].upper() + text[1:]
    details = []
    if verdict in ("unsafe", "overridden"):
        details.append(Detail("But", "this doesn’t count until the errors are corrected."))
    if name in document.savings_range:
        low, high = map(saving, document.savings_range[name])
        text_of = f"powers are estimated; on machines drawn from their bands it is {low} to {high}."
        details.append(Detail("Range", text_of))
    return Answer(question, text, tuple(details), tuple(_steadiness(document)))


def _time_beside(own: Energy, other: Energy, bounded: str) -> str:
    """Compare the times of two programs in words; `bounded` says how sure they are."""
    times = [f"{number(energy.time, 1)} s" for energy in (own, other)]
    if times[0] == times[1]:
        return f"the same time ({times[0]}{bounded})"
    less = _share(1.0 - own.time / other.time if other.time else None, "time")
    return f"{less} ({' against '.join(times)}{bounded})"


def _bounded(document: ReportDocument) -> str:
    """Say that a time is a lower bound, and why; empty where it isn't."""
    unknown = [] if document.solution.energy.timing == "accelerations" else ["accelerations"]
    unlimited = any(axis.max_speed is None for axis in document.machine.axes)
    unknown += ["highest speeds"] if unlimited else []
    return f" or more; unknown: {', '.join(unknown)}" if unknown else ""


def _share(share: float | None, of: str) -> str:
    text = saving(share)
    return f"{of} {UNKNOWN}" if share is None else f"the same {of}" if text == NO_CHANGE else f"{text} {of}"


def _limits(document: ReportDocument) -> Iterator[Detail]:
    solution, name = document.solution, document.timed_against
    energies = {"": solution.energy} | ({} if name is None else {name: solution.baselines[name]})
    limits = [f"{n and f'{n}: '}{time_shares(e.limited)}" for n, e in energies.items() if e.limited]
    if any(set(energy.limited or ()) > {"feed"} for energy in energies.values()):
        yield Detail("Limited by", f"{'; '.join(limits)}.")


def _steadiness(document: ReportDocument) -> Iterator[Detail]:
    """Count starts and reversals; where they cost no time, say so, and how smooth the program is."""
    energy, unknown = document.solution.energy, document.accelerations_unknown
    others = "".join(
        f"; {name}: {number(e.starts)}, {number(e.reversals)}"
        for name, e in document.solution.baselines.items()
    )
    yield Detail(
        "Steadiness", f"starts {number(energy.starts)}, reversals {number(energy.reversals)}{others}."
    )
    short = document.solution.clock.too_short(document.machine)
    if energy.timing == "accelerations" and short:
        yield Detail("Assumed", f"{short}. State it, and changes of acceleration are charged.")
    if energy.timing == "accelerations" or not unknown:
        return
    yield Detail(
        "Assumed",
        "the axes start, stop and reverse without losing time, as the machine file states no "
        f"max_acceleration of {', '.join(unknown)}: time and energy are lower bounds. State it "
        f"([axes.{unknown[0]}]{' and so on' if unknown[1:] else ''}), and starts and reversals are charged.",
    )
    changes = ", ".join(
        f"{c} {speed_change(c, change, document.lines.get(c))}"
        for c, change in energy.steadiness.changes.items()
    )
    if changes:
        text = f"the largest changes from one cutting block of the program to the next: {changes}."
        yield Detail("Speed", text)


def _next(document: ReportDocument, verdict: Verdict) -> Answer:
    question, program, kept = "What to do now?", document.program, document.kept_back
    if verdict == "unsafe" or kept:
        errors = [
            cause.line
            for cause in document.summary
            if cause.severity is Severity.ERROR and (not kept or cause.code in kept)
        ]
        return Answer(question, "Correct the errors, and run it again.", _each("Correct", errors))
    if program is None:
        return Answer(question, "Write the program: this report has none.")
    language = program.language
    if program.revises:
        text = f"Run it in place of the program as it was: {program.revises}, were revised, nothing else."
        if document.trades and not document.replaced_for:
            text = f"Choose: it is {' and '.join(document.trades)} than the program as it was. {text}"
    elif language != "blocks":
        text = f"Post-process the {LISTS.get(language, language)}; what reaches the machine isn’t verified."
    else:
        number_of = "" if program.preparation.tool_number is None else f"T{program.preparation.tool_number}, "
        loaded = f"{number_of}{describe_cutter(document.solution.toolpath.tool)}"
        offset = program.preparation.work_offset or "the work offset"
        text = f"Load {loaded}; set {offset}; bring the tool clear, and start."
    if language == "blocks":
        text = f"{_place(document, revised=bool(program.revises))} {text}"
    if verdict == "overridden":
        text = f"Have the accepted errors judged at the machine. {text}"
    prepared = program.preparation
    start, setting = _start(prepared, language), _setting(document.tool, prepared)
    return Answer(question, text, tuple(start), tuple(setting))


def _place(document: ReportDocument, *, revised: bool) -> str:
    """Say where the part stands on the machine, and how high over its table; of a program as it was, too."""
    setup, standing = document.machine.setup, document.verdict.standing
    at = ", ".join(f"{c} {plain(round(v, 3))}" for c, v in zip("XYZ", setup.offset, strict=True))
    turns = zip("ABC", setup.rotation_deg, strict=True)
    turned = "".join(f", {c} {plain(round(v, 3))}°" for c, v in turns if v)
    over = "" if standing is None else f", {standing}"
    where = f"at {at}{turned} of the machine{over}"
    return f"The part’s zero is {where}." if revised else f"Set the part’s zero {where}."


def _start(prepared: Preparation, language: str) -> Iterator[Detail]:
    turned = ", ".join(f"{c} {plain(round(v, 3))}°" for c, v in prepared.start if c in "ABC")
    moved = ", ".join(f"{c} {plain(round(v, 3))}" for c, v in prepared.start if c in "XYZ")
    if language == "blocks" and moved:
        turns = f"turns {turned}, then " if turned else ""
        yield Detail("Start", f"the approach {turns}goes to {moved} {prepared.unit}.")
    yield from _notes(prepared, "start")


def _setting(tool: str, prepared: Preparation) -> Iterator[Detail]:
    if prepared.work_offset:
        yield Detail("Work offset", f"{prepared.work_offset}.")
    yield from _notes(prepared, "work offset")
    yield Detail("Tool", f"{'' if prepared.tool_number is None else f'T{prepared.tool_number}, '}{tool}.")
    yield from _notes(prepared, "tool")
    if prepared.in_force:
        yield Detail("Control", f"the program sets {', '.join(prepared.in_force)}.")
    yield from _notes(prepared, "control")


def _notes(prepared: Preparation, about: str) -> Iterator[Detail]:
    yield from _each(about.capitalize(), [f"{note.text}." for note in prepared.notes if note.about == about])


def _each(about: str, texts: Sequence[str]) -> tuple[Detail, ...]:
    return tuple(Detail(about, text) for text in texts)


def _codes(codes: Mapping[str, int]) -> str:
    return ", ".join(f"{code} ({number(count)})" for code, count in codes.items())


def _found(summary: Sequence[Cause], *, coded: bool = False) -> list[str]:
    """Count causes by severity, worst first: ``2 errors (axis-limit 400, tilt 2)`` if `coded`."""
    parts = []
    for severity in Severity:
        codes: Counter[str] = Counter()
        for cause in summary:
            if cause.severity is severity:
                codes[cause.code] += cause.count
        if codes:
            total = sum(cause.severity is severity for cause in summary)
            each = ", ".join(f"{code} {number(n)}" for code, n in codes.items())
            parts.append(
                f"{number(total)} {severity}{'' if total == 1 else 's'}{f' ({each})' if coded else ''}"
            )
    return parts
