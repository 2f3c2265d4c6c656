"""The verdict on a motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.toolpath import Toolpath

# A path can have a million bad places; a report lists this many of a kind, the worst.
MOST_LISTED = 1000
SEVERITY_ORDER = list(Severity)


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
    """

    code: str
    severity: Severity
    rows: IntArray
    values: Array
    message: Callable[[int], str]
    figures: Mapping[str, float | None]
    checked: tuple[str, ...] = ()
    not_checked: tuple[str, ...] = ()


def left_out(code: str, figures: Mapping[str, float | None], why: str) -> Result:
    """Give the result of a check that wasn't done: figures without value, and why."""
    return Result(
        code=code,
        severity=Severity.ERROR,
        rows=np.empty(0, dtype=np.int64),
        values=np.empty(0),
        message=str,
        figures=figures,
        not_checked=(why,),
    )


@dataclass(frozen=True)
class Report:
    """What verification found.

    Parameters
    ----------
    findings : sorted by severity, then location; at most `MOST_LISTED` of a code, the worst
    counts : number of violations by code, those that aren't listed included
    figures : the worst value of every check, by name with its unit; None where there was nothing to measure
    checked, not_checked : sentences that say what the verdict rests on and what it leaves open
    about : `motion_digest` of the motion; None where that isn't known
    gouges_between, collisions_between : ways between locations for which there are none but those found:
        ``axes``, all of them linear in time, ``led``, the tool led straight by the control; None where that
        isn't known, or nothing was there to be checked
    lead_in : mm by axis, the last of the way to the first location, back from there, that a program of the
        motion takes; None where the way there wasn't looked at
    lead_out : mm by axis, the way off the last location likewise, zeros where it doesn't end in a cut
    """

    findings: tuple[Finding, ...]
    counts: dict[str, int]
    figures: dict[str, float | None]
    checked: tuple[str, ...]
    not_checked: tuple[str, ...]
    about: str | None = None
    gouges_between: tuple[str, ...] | None = None
    collisions_between: tuple[str, ...] | None = None
    lead_in: tuple[float, ...] | None = None
    lead_out: tuple[float, ...] | None = None

    @property
    def ok(self) -> bool:
        """Whether no finding must keep the motion off a machine; warnings don't."""
        return all(f.severity is not Severity.ERROR for f in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain data for JSON."""
        return {
            "ok": self.ok,
            "findings": [f.as_dict() for f in self.findings],
            "counts": dict(self.counts),
            "figures": dict(self.figures),
            "checked": list(self.checked),
            "not_checked": list(self.not_checked),
        }


def make_report(results: Sequence[Result], toolpath: Toolpath, not_checked: Iterable[str]) -> Report:
    """Put the results of all checks together.

    Parameters
    ----------
    results : in the order in which their figures and sentences appear
    toolpath : gives file and line of every location
    not_checked : sentences about what no check looks at
    """
    findings = [finding for result in results for finding in _list_worst(result, toolpath)]
    findings.sort(key=lambda f: (SEVERITY_ORDER.index(f.severity), f.place.location, f.code))
    return Report(
        findings=tuple(findings),
        counts={r.code: len(r.rows) for r in sorted(results, key=lambda r: r.code) if len(r.rows)},
        figures={name: value for result in results for name, value in result.figures.items()},
        checked=tuple(sentence for result in results for sentence in result.checked),
        not_checked=(*(s for result in results for s in result.not_checked), *not_checked),
    )


def _list_worst(result: Result, toolpath: Toolpath) -> Iterable[Finding]:
    """Make findings of the worst violations; equal ones in the order of the path."""
    ranking = np.argsort(-result.values, kind="stable")[:MOST_LISTED]
    for i in ranking.tolist():
        row, value = int(result.rows[i]), float(result.values[i])
        yield Finding(
            severity=result.severity,
            code=result.code,
            message=result.message(i),
            place=toolpath.place(row),
            value=value if math.isfinite(value) else None,
        )
