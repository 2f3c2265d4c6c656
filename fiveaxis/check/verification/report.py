"""Reports: what checks found, and how reports are merged.

Every report has its checks, each with the number of violations found and the rows that it covers. So reports
can be merged in any order: the same check on the same rows counts once, different ones add up.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from fiveaxis.base import (
    Array,
    Cause,
    Finding,
    Gap,
    IntArray,
    SettingError,
    Severity,
    ShownAsTable,
    Table,
    group_findings,
    has_errors,
    sort_findings,
)
from fiveaxis.check.collision.assumed import Standing
from fiveaxis.check.stock.cutting import CutStock
from fiveaxis.model import Toolpath

T = TypeVar("T")

# Most findings that a report lists per check: the worst, and the first on the path.
MOST_LISTED = 1000
# Rows that checks cover: those of the path, inserted ones included; those of approach and retract; and none,
# for findings of a reader.
PATH, APPROACH, READING = "path", "approach", "reading"
# Figures whose worst value is the smallest.
SMALLEST = ("tilt_min_deg",)


# Rows of a check that found nothing, or of which only sentences are left to say.
NOWHERE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Result:
    """What one check found.

    Parameters
    ----------
    code : of its findings
    rows : (m,), location of each violation
    message : one for all violations, or that of violation 0…m−1, called only for those listed
    values : (m,), figure that ranks the violations, worst is largest; None if none is worse than another
    severity : of its findings
    figures : worst values over the whole path by name, None for none
    checked : sentences on what holds if the check finds nothing worse than a note
    not_checked : what the check leaves open
    was_made : False for a check that wasn't run; then `not_checked` states why
    path : whose locations the rows are; by default those of the motion that the report is about
    cut : the stock that the check has cut
    standing : how the part stands over an assumed table
    """

    code: str
    rows: IntArray = field(default_factory=NOWHERE.copy)
    message: str | Callable[[int], str] = ""
    values: Array | None = None
    severity: Severity = Severity.ERROR
    figures: Mapping[str, float | None] = field(default_factory=dict)
    checked: tuple[str, ...] = ()
    not_checked: tuple[Gap, ...] = ()
    was_made: bool = True
    path: Toolpath | None = None
    cut: CutStock | None = None
    standing: Standing | None = None

    @property
    def ranks(self) -> Array:
        """The values, (m,); NaN where none is worse than another."""
        return np.full(len(self.rows), np.nan) if self.values is None else self.values

    def text(self, i: int) -> str:
        """Return the message of a violation."""
        return self.message if isinstance(self.message, str) else self.message(i)


def left_out(code: str, figures: Mapping[str, float | None], *why: Gap) -> Result:
    """Return the result of a check that wasn't run: its known figures, and why."""
    return Result(code, figures=figures, not_checked=why, was_made=False)


@dataclass(frozen=True)
class Check:
    """One check on some rows.

    Parameters
    ----------
    code : of its findings
    rows : name of the rows that it covers
    """

    code: str
    rows: str = PATH


@dataclass(frozen=True)
class Report(ShownAsTable):
    """What verification found.

    Parameters
    ----------
    findings : sorted by severity, place and code; at most `MOST_LISTED` per check
    checks : the checks that were run, with the number of violations found, including those not listed
    figures : the worst value of every check, by name with its unit; None if there was nothing to measure
    claims : sentences on what was checked, each with the check that shows it false where it finds more than
        notes; None if no check does
    gaps : what wasn't checked, each with the check that settles it; None if no check does, or the check that
        ran leaves it open
    about : `motion_digest` of the motion; None if unknown
    cut : the stock that the program has cut; None if none was given
    standing : how the part stands over an assumed table; None where the table is described, or nothing was
        checked against one
    """

    findings: tuple[Finding, ...]
    checks: Mapping[Check, int]
    figures: dict[str, float | None]
    claims: tuple[tuple[str, Check | None], ...]
    gaps: tuple[tuple[Gap, Check | None], ...]
    about: str | None = None
    cut: CutStock | None = None
    standing: Standing | None = None

    @classmethod
    def of_findings(cls, findings: Iterable[Finding], rows: str = READING) -> Report:
        """Build a report from findings that don't come from a check on rows of a motion.

        `rows` is the name of the rows that they are about.
        """
        listed = sort_findings(findings)
        return cls(listed, Counter(Check(f.code, rows) for f in listed), {}, (), ())

    def __repr__(self) -> str:
        found = ", ".join(f"{code} ({count})" for code, count in self.counts.items() if count)
        return f"<Report: {'no errors' if self.ok else 'errors'}; {found or 'no findings'}>"

    def _table(self) -> Table:
        rows = [(cause.severity, cause.code, cause.count, cause.worst.message) for cause in self.summary()]
        return ("severity", "code", "count", "worst"), [
            *rows,
            *(("not checked", "", "", sentence) for sentence in self.not_checked),
        ]

    @property
    def ok(self) -> bool:
        """Whether there are no errors; warnings are acceptable."""
        return not has_errors(self.findings)

    @property
    def counts(self) -> dict[str, int]:
        """Number of violations by code, sorted by code, including those not listed."""
        total: Counter[str] = Counter()
        for check, count in self.checks.items():
            total[check.code] += count
        return {code: total[code] for code in sorted(total) if total[code]}

    @property
    def failed(self) -> tuple[Cause, ...]:
        """The errors, by cause."""
        return tuple(cause for cause in self.summary() if cause.severity is Severity.ERROR)

    @property
    def passed(self) -> tuple[str, ...]:
        """Sentences on what was checked and holds: none that any check shows false."""
        worse = {f.code for f in self.findings if f.severity is not Severity.NOTE}
        failed = {check for check, count in self.checks.items() if count and check.code in worse}
        false = {sentence for sentence, check in self.claims if check in failed}
        return _each_once(sentence for sentence, _ in self.claims if sentence not in false)

    @property
    def risks(self) -> tuple[Gap, ...]:
        """What wasn't checked although the program may do harm because of it."""
        return _each_once(gap for gap, _ in self.gaps if gap.is_risk)

    @property
    def not_asked(self) -> tuple[Gap, ...]:
        """What else wasn't checked: nobody asked for it, or it can do no harm."""
        return _each_once(gap for gap, _ in self.gaps if not gap.is_risk)

    @property
    def not_checked(self) -> tuple[str, ...]:
        """Sentences on what wasn't checked, risks first."""
        return _each_once(gap.sentence for gap in (*self.risks, *self.not_asked))

    def summary(self) -> tuple[Cause, ...]:
        """Group the findings by code: their number, the worst, and the place of the first."""
        return group_findings(self.findings, self.counts)

    def merge(self, *others: Report) -> Report:
        """Merge reports on one motion; nothing else in the project does.

        The order of the reports affects only that of sentences and figures, and a repeated report counts
        once. The merged report has

        - all findings; of those with the same code, place and message the severest one;
        - all checks. One that several reports ran on the same rows has the largest of their numbers; checks
          on different rows add up in `counts`;
        - the worst of every figure: the largest, for `SMALLEST` the smallest;
        - all sentences once: as passed only where no report's check shows them false, as not checked only
          where no other report ran the check on those rows.

        Raises
        ------
        SettingError
            Reports about different motions.
        """
        reports = (self, *others)
        checks: Counter[Check] = Counter()
        for report in reports:
            checks |= Counter(report.checks)
        made = {check: checks[check] for report in reports for check in report.checks}
        gaps = _each_once(pair for report in reports for pair in report.gaps)
        return Report(
            findings=sort_findings(f for report in reports for f in report.findings),
            checks=made,
            figures=_worst_figures(reports),
            claims=_each_once(claim for report in reports for claim in report.claims),
            gaps=tuple((gap, check) for gap, check in gaps if check not in made),
            about=_the_motion(reports),
            cut=next((report.cut for report in reports if report.cut is not None), None),
            standing=next((report.standing for report in reports if report.standing is not None), None),
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain data for JSON."""
        return {
            "ok": self.ok,
            "summary": [cause.as_dict() for cause in self.summary()],
            "findings": [f.as_dict() for f in self.findings],
            "counts": self.counts,
            "figures": dict(self.figures),
            "table": None if self.standing is None else self.standing.as_dict(),
            "failed": [{"code": cause.code, "count": cause.count} for cause in self.failed],
            "passed": list(self.passed),
            "not_checked": {
                "risks": [gap.as_dict() for gap in self.risks],
                "not_asked": [gap.as_dict() for gap in self.not_asked],
            },
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


def _the_motion(reports: Sequence[Report]) -> str | None:
    """Return the motion that the reports agree on; None if none states it."""
    known = {report.about for report in reports if report.about is not None}
    if len(known) > 1:
        raise SettingError("the reports are about different motions; merge those about one motion")
    return next(iter(known), None)


def make_report(results: Sequence[Result], toolpath: Toolpath, not_checked: Iterable[Gap]) -> Report:
    """Build a report from the results of checks on the rows of a motion.

    Parameters
    ----------
    results : in the order in which their figures and sentences appear
    toolpath : has file and line of every location
    not_checked : what no check covers
    """
    checks: Counter[Check] = Counter()
    for result in results:
        if result.was_made:
            checks[Check(result.code)] += len(result.rows)
    gaps = [
        (gap, None if result.was_made else Check(result.code))
        for result in results
        for gap in result.not_checked
    ]
    return Report(
        findings=sort_findings(f for result in results for f in _list_worst(result, toolpath)),
        checks=dict(checks),
        figures={name: value for result in results for name, value in result.figures.items()},
        claims=tuple((s, Check(result.code)) for result in results for s in result.checked),
        gaps=(*gaps, *((gap, None) for gap in not_checked)),
        cut=next((result.cut for result in results if result.cut is not None), None),
        standing=next((result.standing for result in results if result.standing is not None), None),
    )


def _list_worst(result: Result, toolpath: Toolpath) -> Iterable[Finding]:
    """Yield findings of the worst violations, and of the first one on the path."""
    toolpath = toolpath if result.path is None else result.path
    listed = np.argsort(-result.ranks, kind="stable")[:MOST_LISTED]
    if len(listed) == MOST_LISTED:
        listed[-1] = listed[-1] if result.rows.min() in result.rows[listed] else result.rows.argmin()
    for i in listed.tolist():
        row, value = int(result.rows[i]), float(result.ranks[i])
        yield Finding(
            severity=result.severity,
            code=result.code,
            message=result.text(i),
            place=toolpath.place(row),
            value=value if math.isfinite(value) else None,
        )
