"""Findings: what a check has to say about a path, place by place.

A finding is data, not an exception: a path with a thousand bad places has a thousand findings. Codes are
stable, so scripts may depend on them. People read them by cause (`group_findings`), one line each.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from typing import Any


class Severity(StrEnum):
    """How bad a finding is, by its consequence on the machine."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        """0 for the worst."""
        return list(Severity).index(self)


@dataclass(frozen=True)
class Place:
    """Where on the path: a location's index (from 0) and the source line it came from (from 1)."""

    location: int | None = None
    line: int | None = None
    file: str | None = None

    def __str__(self) -> str:
        parts = []
        if self.file is not None:
            parts.append(self.file if self.line is None else f"{self.file}:{self.line}")
        elif self.line is not None:
            parts.append(f"line {self.line}")
        if self.location is not None:
            parts.append(f"location {self.location}")
        return ", ".join(parts)

    @property
    def order(self) -> tuple[bool, int, bool, int, str]:
        """What places are sorted by: along the path, then along the file; the path as a whole comes last."""
        return (
            self.location is None,
            self.location or 0,
            self.line is None,
            self.line or 0,
            self.file or "",
        )


@dataclass(frozen=True)
class Finding:
    """One thing found at one place.

    Parameters
    ----------
    severity : by consequence: an ``error`` must not reach a machine
    code : stable name, e.g. ``axis-limit``
    message : fact with value, bound and unit; what to do
    place : where on the path
    value : the figure behind the message, in the unit the message names; worst is largest
    """

    severity: Severity
    code: str
    message: str
    place: Place = field(default_factory=Place)
    value: float | None = None

    def __str__(self) -> str:
        where = str(self.place)
        return f"{where}: {self.message} [{self.code}]" if where else f"{self.message} [{self.code}]"

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as plain data for JSON, which knows no infinite figure: it is None there."""
        finite = self.value is not None and math.isfinite(self.value)
        return asdict(self) | {"value": self.value if finite else None}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Finding:
        """Make a finding of plain data again, as `as_dict` gives it."""
        return cls(
            Severity(data["severity"]), data["code"], data["message"], Place(**data["place"]), data["value"]
        )


@dataclass(frozen=True)
class Cause:
    """Findings of one code: one thing for a person to put right.

    Parameters
    ----------
    severity, code : of all of them
    count : how many there are, those that aren't listed included
    worst : the one of the largest value; the first where none has a value
    first : place of the first along the path
    """

    severity: Severity
    code: str
    count: int
    worst: Finding
    first: Place

    def __str__(self) -> str:
        fact, semicolon, remedy = self.worst.message.partition("; ")
        fact = f"{fact}{self._places()}{semicolon}{remedy}"
        return f"{self.severity}: {self.code} ({self.count}): {fact} [{self.code}]"

    def _places(self) -> str:
        place = self.worst.place
        if not str(place):
            return ""
        if self.count == 1:
            return f", at {place}"
        if self.worst.value is None:
            return f", first at {self.first}"
        if place == self.first:
            return f", worst and first at {place}"
        first = replace(self.first, file=None) if self.first.file == place.file else self.first
        return f", worst at {place}; first at {first}"

    def as_dict(self) -> dict[str, Any]:
        """Return the cause as plain data for JSON, with its line as ``text``."""
        return asdict(self) | {"worst": self.worst.as_dict(), "text": str(self)}


def group_findings(findings: Iterable[Finding], counts: Mapping[str, int] | None = None) -> tuple[Cause, ...]:
    """Put findings of one code and severity together; each without a place stands for itself.

    Parameters
    ----------
    findings : in any order
    counts : how many there are by code, where not all are listed, or some are listed twice; those that
        aren't listed count as of the severest of the code

    Returns
    -------
    Worst severity first, then by code
    """
    groups: dict[tuple[int, str, str], list[Finding]] = {}
    for finding in findings:
        alone = "" if str(finding.place) else finding.message
        groups.setdefault((finding.severity.rank, finding.code, alone), []).append(finding)
    number = {key: len(group) for key, group in groups.items()}
    for code, total in (counts or {}).items():
        keys = sorted(key for key in groups if key[1] == code)
        if keys:
            number[keys[0]] = max(total - sum(number[key] for key in keys[1:]), 1)
    return tuple(_cause(groups[key], number[key]) for key in sorted(groups))


def _cause(group: list[Finding], count: int) -> Cause:
    along = sorted(group, key=lambda f: f.place.order)
    worst = max(along, key=lambda f: -math.inf if f.value is None else f.value)
    return Cause(worst.severity, worst.code, count, worst, along[0].place)


def sort_findings(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sort findings by severity, place and code, the worst first of one code at one place.

    Of findings with the same code, place and message the severest is kept, or that of the largest value.
    """
    kept: dict[tuple[str, Place, str], Finding] = {}
    for finding in sorted(findings, key=_order):
        kept.setdefault((finding.code, finding.place, finding.message), finding)
    return tuple(kept.values())


def _order(finding: Finding) -> tuple[Any, ...]:
    value = -math.inf if finding.value is None else finding.value
    return (finding.severity.rank, finding.place.order, finding.code, -value, finding.message)


def count_codes(findings: Iterable[Finding]) -> dict[str, int]:
    """Count findings by code, sorted by code."""
    return dict(sorted(Counter(f.code for f in findings).items()))


def has_errors(findings: Iterable[Finding]) -> bool:
    """Tell whether any finding must keep the path off a machine."""
    return any(f.severity is Severity.ERROR for f in findings)
