"""The verdict on a motion: what checks found, and how reports are joined to one.

Every report carries the checks that it rests on, each with the number of violations that it found and the
rows that it looked at. So reports can be merged in any order: the same check on the same rows counts once,
different ones add up.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.findings import Cause, Finding, Severity, group_findings, has_errors, sort_findings
from fiveaxis.geometry import Array, IntArray
from fiveaxis.toolpath import Toolpath

T = TypeVar("T")

# A path can have a million bad places; a report lists this many of a check: the worst, and the first.
MOST_LISTED = 1000
# Rows that checks look at: those of the path, a program's inserted ones included; those of the program's ways
# in and out; and none, where reading said something.
PATH, APPROACH, READING = "path", "approach", "reading"
# Figures whose worst value is the smallest.
SMALLEST = ("tilt_min_deg",)


@dataclass(frozen=True, eq=False)
class Result:
    """What one check found.

    Parameters
    ----------
    code, severity : of its findings
    rows : (m,), location of each violation
    values : (m,), the figure that ranks the violations, worst is largest; NaN where there is none
    message : text of violation number 0…m−1; made only for those that are listed
    figures : worst values over the whole path by name, None where the path has none
    checked : sentences that say what was checked
    not_checked : sentences that say what wasn't
    was_made : False for a check that wasn't made at all; then `not_checked` says why
    """

    code: str
    severity: Severity
    rows: IntArray
    values: Array
    message: Callable[[int], str]
    figures: Mapping[str, float | None]
    checked: tuple[str, ...] = ()
    not_checked: tuple[str, ...] = ()
    was_made: bool = True


def left_out(code: str, figures: Mapping[str, float | None], *why: str) -> Result:
    """Give the result of a check that wasn't made: its figures, as far as they are known, and why."""
    return Result(
        code=code,
        severity=Severity.ERROR,
        rows=np.empty(0, dtype=np.int64),
        values=np.empty(0),
        message=str,
        figures=figures,
        not_checked=why,
        was_made=False,
    )


@dataclass(frozen=True)
class Check:
    """One check: what it looks for, and where.

    Parameters
    ----------
    code : of its findings
    rows : name of the rows that it looks at; those of one name are the same places
    """

    code: str
    rows: str = PATH


@dataclass(frozen=True)
class Gap:
    """Something that wasn't checked.

    Parameters
    ----------
    sentence : what, and why
    settled_by : the check that wasn't made; None for what no check of this version looks at, or what one that
        was made leaves open
    """

    sentence: str
    settled_by: Check | None = None


@dataclass(frozen=True)
class Report:
    """What verification found.

    Parameters
    ----------
    findings : sorted by severity, place and code; at most `MOST_LISTED` of a check
    checks : the checks that were made, with the number of violations that each found, those that aren't
        listed included
    figures : the worst value of every check, by name with its unit; None where there was nothing to measure
    checked : sentences that say what the verdict rests on
    gaps : what it leaves open
    about : `motion_digest` of the motion; None where that isn't known
    gouges_between, collisions_between : ways between locations for which there are none but those found:
        ``axes``, all of them linear in time, ``led``, the tool led straight by the control; None where that
        isn't known, or nothing was there to be checked
    lead_in : mm by axis, the last of the way to the first location, back from there, that a program of the
        motion takes; None where the way there wasn't looked at
    lead_out : mm by axis, the way off the last location likewise, zeros where it doesn't end in a cut
    """

    findings: tuple[Finding, ...]
    checks: Mapping[Check, int]
    figures: dict[str, float | None]
    checked: tuple[str, ...]
    gaps: tuple[Gap, ...]
    about: str | None = None
    gouges_between: tuple[str, ...] | None = None
    collisions_between: tuple[str, ...] | None = None
    lead_in: tuple[float, ...] | None = None
    lead_out: tuple[float, ...] | None = None

    @classmethod
    def of_findings(
        cls, findings: Iterable[Finding], rows: str = READING, counts: Mapping[str, int] | None = None
    ) -> Report:
        """Make a report of findings that no check on rows of a motion made.

        Parameters
        ----------
        findings : in any order
        rows : what they are about
        counts : how many there are by code, where more were found than are listed
        """
        listed = sort_findings(findings)
        total = Counter(f.code for f in listed) | Counter(counts)
        return cls(listed, {Check(code, rows): count for code, count in total.items()}, {}, (), ())

    @property
    def ok(self) -> bool:
        """Whether no finding must keep the motion off a machine; warnings don't."""
        return not has_errors(self.findings)

    @property
    def counts(self) -> dict[str, int]:
        """Number of violations by code, sorted by code, those that aren't listed included."""
        total: Counter[str] = Counter()
        for check, count in self.checks.items():
            total[check.code] += count
        return {code: total[code] for code in sorted(total) if total[code]}

    @property
    def not_checked(self) -> tuple[str, ...]:
        """Sentences that say what the verdict leaves open."""
        return _each_once(gap.sentence for gap in self.gaps)

    def summary(self) -> tuple[Cause, ...]:
        """Give one cause a code, for people: how many findings, the worst and where the first one is."""
        return group_findings(self.findings, self.counts)

    def merge(self, *others: Report) -> Report:
        """Join reports on one motion; nothing else in the project does.

        The order of the reports decides nothing but that of sentences and figures, and a report that comes
        twice counts once. The joint report has

        - the findings of all, those with the same code, place and message once, the severest of them;
        - every check that one of them made. One that several made on the same rows has the largest of their
          numbers; checks on different rows add up in `counts`;
        - of every figure the worst: the largest, and of `SMALLEST` the smallest;
        - all sentences once, but none about a check that wasn't made if another report made it on those rows;
        - the ways between locations that any of them looked at, and the lead-in and lead-out of the one that
          has them.

        Raises
        ------
        SettingError
            Reports about different motions, or with different lead-ins or lead-outs.
        """
        reports = (self, *others)
        checks: Counter[Check] = Counter()
        for report in reports:
            checks |= Counter(report.checks)
        made = {check: checks[check] for report in reports for check in report.checks}
        gaps = _each_once(gap for report in reports for gap in report.gaps)
        return Report(
            findings=sort_findings(f for report in reports for f in report.findings),
            checks=made,
            figures=_worst_figures(reports),
            checked=_each_once(sentence for report in reports for sentence in report.checked),
            gaps=tuple(gap for gap in gaps if gap.settled_by not in made),
            about=_the_one("are about different motions", [r.about for r in reports]),
            gouges_between=_any_of(r.gouges_between for r in reports),
            collisions_between=_any_of(r.collisions_between for r in reports),
            lead_in=_the_one("have different lead-ins", [r.lead_in for r in reports]),
            lead_out=_the_one("have different lead-outs", [r.lead_out for r in reports]),
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain data for JSON."""
        return {
            "ok": self.ok,
            "summary": [cause.as_dict() for cause in self.summary()],
            "findings": [f.as_dict() for f in self.findings],
            "counts": self.counts,
            "figures": dict(self.figures),
            "checked": list(self.checked),
            "not_checked": list(self.not_checked),
        }


def _each_once(values: Iterable[T]) -> tuple[T, ...]:
    return tuple(dict.fromkeys(values))


def _worst_figures(reports: Sequence[Report]) -> dict[str, float | None]:
    worst: dict[str, float | None] = {}
    for report in reports:
        for name, value in report.figures.items():
            known = [v for v in (worst.get(name), value) if v is not None]
            worst[name] = (min if name in SMALLEST else max)(known, default=None)
    return worst


def _any_of(ways: Iterable[tuple[str, ...] | None]) -> tuple[str, ...] | None:
    known = [way for way in ways if way is not None]
    return tuple(sorted({name for way in known for name in way})) if known else None


def _the_one(fault: str, values: Iterable[T | None]) -> T | None:
    """Give the value that reports agree on; None where none has one."""
    known = {value for value in values if value is not None}
    if len(known) > 1:
        raise SettingError(f"the reports {fault}; merge those about one motion")
    return next(iter(known), None)


def make_report(results: Sequence[Result], toolpath: Toolpath, not_checked: Iterable[str]) -> Report:
    """Put the results of checks on the rows of a motion together.

    Parameters
    ----------
    results : in the order in which their figures and sentences appear
    toolpath : gives file and line of every location
    not_checked : sentences about what no check looks at
    """
    checks: Counter[Check] = Counter()
    for result in results:
        if result.was_made:
            checks[Check(result.code)] += len(result.rows)
    gaps = [
        Gap(sentence, None if result.was_made else Check(result.code))
        for result in results
        for sentence in result.not_checked
    ]
    return Report(
        findings=sort_findings(f for result in results for f in _list_worst(result, toolpath)),
        checks=dict(checks),
        figures={name: value for result in results for name, value in result.figures.items()},
        checked=tuple(sentence for result in results for sentence in result.checked),
        gaps=(*gaps, *(Gap(sentence) for sentence in not_checked)),
    )


def _list_worst(result: Result, toolpath: Toolpath) -> Iterable[Finding]:
    """Make findings of the worst violations, and of the first one on the path."""
    listed = np.argsort(-result.values, kind="stable")[:MOST_LISTED]
    if len(listed) == MOST_LISTED:
        listed[-1] = listed[-1] if result.rows.min() in result.rows[listed] else result.rows.argmin()
    for i in listed.tolist():
        row, value = int(result.rows[i]), float(result.values[i])
        yield Finding(
            severity=result.severity,
            code=result.code,
            message=result.message(i),
            place=toolpath.place(row),
            value=value if math.isfinite(value) else None,
        )
