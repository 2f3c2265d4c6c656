"""What a machinist asks first: is it safe, what does it save, what to do now.

The page, the JSON document and the terminal give the same answers, as lines of plain text.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from fiveaxis.findings import Severity
from fiveaxis.report.tables import number, plain, saving, speed_change

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
    """

    question: str
    text: str
    details: tuple[Detail, ...] = ()

    @property
    def lines(self) -> tuple[str, ...]:
        """The answer as lines of plain text, the answer itself first."""
        return (self.text, *(f"{about}: {text}" for about, text in self.details))

    def as_dict(self) -> dict[str, Any]:
        """Return the answer as plain data for JSON."""
        details = [detail._asdict() for detail in self.details]
        return {"question": self.question, "text": self.text, "details": details}


@dataclass(frozen=True)
class Answers:
    """The three answers.

    Parameters
    ----------
    verdict : ``safe``, ``partial`` (not everything was checked), ``unknown`` (nothing was), ``unsafe`` or
        ``overridden``
    safe, saved, next : whether the program is safe to run, what it saves, what to do now
    """

    verdict: str
    safe: Answer
    saved: Answer
    next: Answer

    def __iter__(self) -> Iterator[Answer]:
        return iter((self.safe, self.saved, self.next))

    def as_dict(self) -> dict[str, Any]:
        """Return the answers as plain data for JSON."""
        return {
            "verdict": self.verdict,
            "safe": self.safe.as_dict(),
            "saved": self.saved.as_dict(),
            "next": self.next.as_dict(),
        }


def answers(document: Mapping[str, Any]) -> Answers:
    """Answer the three questions from a report's document; nothing is claimed beyond what was checked.

    Parameters
    ----------
    document : of `report_document`
    """
    verdict = _verdict(document)
    return Answers(verdict, _is_safe(document, verdict), _saved(document, verdict), _next(document, verdict))


def _verdict(document: Mapping[str, Any]) -> str:
    verification = document["verification"]
    if document.get("overridden"):
        return "overridden"
    if not verification["ok"]:
        return "unsafe"
    if not verification["checked"]:
        return "unknown"
    return "partial" if verification["not_checked"] else "safe"


def _is_safe(document: Mapping[str, Any], verdict: str) -> Answer:
    verification, found = document["verification"], _found(document["summary"])
    gaps = verification["not_checked"]
    remarks = f" with {' and '.join(found)}" if found else ""
    text = {
        "overridden": "No: errors were found, and accepted by name.",
        "unsafe": "No: don’t run this program.",
        "safe": f"Yes: every check passed{remarks}.",
        "partial": f"Verified{remarks}, no errors; not everything was checked.",
        "unknown": "Unknown: nothing was checked.",
    }[verdict]
    return Answer("Is it safe to run?", text, (*_judged(document), *_each("Not checked", gaps)))


def _judged(document: Mapping[str, Any]) -> Iterator[Detail]:
    """Name what was found, what of it keeps the program back, and what was accepted by whom."""
    found = _found(document["summary"], coded=True)
    yield Detail("Found", f"{', '.join(found) or 'nothing'}.")
    kept = _codes(document.get("kept_back", {}))
    if kept:
        yield Detail("Kept back", f"No NC program was written, because of {kept}.")
    accepted = _codes(document.get("overridden") or {})
    if accepted:
        who = document.get("overridden_by") or "an unknown person"
        written = "" if kept else " The program was written with them, and its header names each."
        yield Detail("Overridden", f"{accepted}, by {who}.{written}")


def _saved(document: Mapping[str, Any], verdict: str) -> Answer:
    question, best = "What does it save?", best_baseline(document)
    if best is None:
        return Answer(
            question, "Unknown: there is no baseline to compare with.", tuple(_steadiness(document))
        )
    name, measure = best
    energy, baseline = document["energy"], document["baselines"][name]
    share = document["savings"][name][measure]
    figures = (
        f"{number(energy[measure])} J against {number(baseline[measure])} J of the best baseline, {name}"
    )
    text = f"{_share(share)}: {figures} ({BOUNDARIES[measure]})."
    details = []
    if verdict in ("unsafe", "overridden"):
        details.append(Detail("But", "this doesn’t count until the errors are corrected."))
    ends = document["savings_range"].get(name) if measure == "total" else None
    if ends is not None:
        low, high = (saving(end) for end in ends)
        text_of = f"powers are estimated; on machines drawn from their bands it is {low} to {high}."
        details.append(Detail("Range", text_of))
    own, other = (number(e["time"], 1) for e in (energy, baseline))
    details.append(Detail("Time", f"{own} s, with that baseline {other} s."))
    return Answer(question, text, (*details, *_steadiness(document)))


def _steadiness(document: Mapping[str, Any]) -> Iterator[Detail]:
    """Count starts and reversals; where they cost no time, say so, and how smooth the program is."""
    energy, unknown = document["energy"], document["machine"]["acceleration_unknown"]
    others = "".join(
        f"; {name}: {number(e['starts'])}, {number(e['reversals'])}"
        for name, e in document["baselines"].items()
    )
    counts = f"starts {number(energy['starts'])}, reversals {number(energy['reversals'])}"
    yield Detail("Steadiness", f"{counts}{others}.")
    if energy["timing"] == "accelerations" or not unknown:
        return
    yield Detail(
        "Assumed",
        "the axes start, stop and reverse without losing time, as the machine file states no "
        f"max_acceleration of {', '.join(unknown)}: time and energy are lower bounds. State it "
        f"([axes.{unknown[0]}]{' and so on' if unknown[1:] else ''}), and starts and reversals are charged.",
    )
    changes = [f"{c} {speed_change(change)}" for c, change in energy["speed_changes"].items()]
    if changes:
        text = f"the largest changes from one cutting block of the program to the next: {', '.join(changes)}."
        yield Detail("Speed", text)


def _share(share: float | None) -> str:
    text = saving(share)
    return f"{text} energy" if text[:1].isdigit() else f"{text[:1].upper()}{text[1:]}"


def best_baseline(document: Mapping[str, Any]) -> tuple[str, str] | None:
    """Find the baseline that costs the least, and the measure by which it is compared.

    Returns
    -------
    Its name, and ``with_base`` where the base power is known and no drive is estimated, else ``total``; None
    without a baseline
    """
    energies = {name: e for name, e in document["baselines"].items() if e["total"] is not None}
    # The range of a saving with estimated powers is that of the feed drives.
    drives = document["energy"]["with_base"] is None or document["savings_range"]
    measure = "total" if drives else "with_base"
    best = min(energies, key=lambda name: energies[name][measure], default=None)
    return None if best is None else (best, measure)


def _next(document: Mapping[str, Any], verdict: str) -> Answer:
    question, program, kept = "What to do now?", document["program"], document.get("kept_back")
    errors = [
        cause["text"].removeprefix(f"{Severity.ERROR}: ").removesuffix(f" [{cause['code']}]")
        for cause in document["summary"]
        if cause["severity"] == Severity.ERROR and (not kept or cause["code"] in kept)
    ]
    if verdict == "unsafe" or kept:
        return Answer(question, "Correct the errors, and run it again.", _each("Correct", errors))
    prepared = None if program is None else program.get("preparation")
    if program is None or prepared is None:
        return Answer(question, "Write the program: this report has none.")
    language = program["language"]
    if language != "blocks":
        text = f"Post-process the {LISTS.get(language, language)}; what reaches the machine isn’t verified."
    else:
        text = "Load the tool, set the work offset, bring the tool clear of part and table, and start."
    if verdict == "overridden":
        text = f"Have the accepted errors judged at the machine. {text}"
    return Answer(question, text, (*_start(prepared, language), *_setting(document, prepared)))


def _start(prepared: Mapping[str, Any], language: str) -> Iterator[Detail]:
    """Say where the program's approach begins and leads to."""
    turned = ", ".join(f"{c} {plain(round(v, 3))}°" for c, v in prepared["start"].items() if c in "ABC")
    moved = ", ".join(f"{c} {plain(round(v, 3))}" for c, v in prepared["start"].items() if c in "XYZ")
    if language == "blocks" and moved:
        turns = f"turns {turned}, then " if turned else ""
        yield Detail("Start", f"the approach {turns}goes to {moved} {prepared['unit']}.")
    yield from _notes(prepared, "start", "Start")


def _setting(document: Mapping[str, Any], prepared: Mapping[str, Any]) -> Iterator[Detail]:
    """Say which offset, tool and states of the control the program needs."""
    if prepared["work_offset"]:
        yield Detail("Work offset", f"{prepared['work_offset']}.")
    yield from _notes(prepared, "work offset", "Work offset")
    number_of = prepared["tool_number"]
    yield Detail("Tool", f"{'' if number_of is None else f'T{number_of}, '}{document['tool_in_words']}.")
    yield from _notes(prepared, "tool", "Tool")
    if prepared["in_force"]:
        yield Detail("Control", f"the program sets {', '.join(prepared['in_force'])}.")
    yield from _notes(prepared, "control", "Control")


def _notes(prepared: Mapping[str, Any], about: str, head: str) -> Iterator[Detail]:
    # Most notes begin with the word that heads them here.
    texts = [note["text"] for note in prepared["notes"] if note["about"] == about]
    yield from _each(head, [f"{text.removeprefix(f'{about}: ')}." for text in texts])


def _each(about: str, texts: Sequence[str]) -> tuple[Detail, ...]:
    return tuple(Detail(about, text) for text in texts)


def _codes(codes: Mapping[str, int]) -> str:
    return ", ".join(f"{code} ({number(count)})" for code, count in codes.items())


def _found(summary: Sequence[Mapping[str, Any]], *, coded: bool = False) -> list[str]:
    """Count findings by severity, worst first: ``6 errors (axis-limit 4, tilt 2)`` if `coded`."""
    parts = []
    for wanted in Severity:
        codes: Counter[str] = Counter()
        for cause in summary:
            if cause["severity"] == wanted:
                codes[cause["code"]] += cause["count"]
        if codes:
            total = codes.total()
            each = ", ".join(f"{code} {number(n)}" for code, n in codes.items())
            parts.append(
                f"{number(total)} {wanted}{'' if total == 1 else 's'}{f' ({each})' if coded else ''}"
            )
    return parts
