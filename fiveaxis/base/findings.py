"""Findings: what checks find on a path, each with its place.

A finding is data, not an exception: a path with a thousand faults has a thousand findings. Codes are stable,
so scripts may depend on them. For people they are grouped by cause (`group_findings`), one line each.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from pathlib import PurePath
from typing import Any

# Where figures are given that settle what wasn't checked.
JOB, MACHINE_FILE, TOOL_FILE = "job", "machine file", "tool file"


class Severity(StrEnum):
    """Severity of a finding, by its consequence on the machine."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        """0 for the worst."""
        return list(Severity).index(self)


@dataclass(frozen=True)
class Place:
    """Where on the path: index of the location (from 0), source line (from 1) and file."""

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
        """Sort key: along the path, then along the file; the path as a whole comes last."""
        return (self.location is None, self.location or 0, self.line is None, self.line or 0, self.file or "")


def without_folder(name: str) -> str:
    """Keep the last part of an absolute path; anything else stays as it is."""
    path = PurePath(name)
    return path.name if path.is_absolute() else name


@dataclass(frozen=True)
class Finding:
    """One fault or remark at one place.

    Parameters
    ----------
    severity : by consequence: an ``error`` must not reach a machine
    code : stable name, e.g. ``axis-limit``
    message : fact with value, bound and unit; what to do
    place : where on the path
    value : the value in the message, in its unit; the largest is the worst
    """

    severity: Severity
    code: str
    message: str
    place: Place = field(default_factory=Place)
    value: float | None = None

    def __str__(self) -> str:
        where = str(self.place)
        return f"{where}: {self.message} [{self.code}]" if where else f"{self.message} [{self.code}]"

    @property
    def remedy(self) -> str:
        """What to do: what stands last in the message."""
        return self.message.rpartition("; ")[2]

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as plain data for JSON; a value that isn't finite is None."""
        finite = self.value is not None and math.isfinite(self.value)
        return asdict(self) | {"value": self.value if finite else None}

    def portable(self) -> Finding:
        """Return the finding without the folder of its file: what it is written to may be passed on."""
        file = self.place.file
        return self if file is None else replace(self, place=replace(self.place, file=without_folder(file)))

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Finding:
        """Make a finding from the plain data of `as_dict`."""
        return cls(
            Severity(data["severity"]), data["code"], data["message"], Place(**data["place"]), data["value"]
        )


@dataclass(frozen=True)
class Gap:
    """Something that wasn't checked.

    Parameters
    ----------
    sentence : what, and after a colon why
    add, to : what settles it, a key, table or option, and where it is added: `JOB`, `MACHINE_FILE` or
        `TOOL_FILE`; empty where nothing does
    is_risk : whether the program could touch something, or ask for what the machine can't do, because of it;
        else nobody asked for the check, or it decides no more than how well the machine runs
    """

    sentence: str
    add: str = ""
    to: str = ""
    is_risk: bool = False

    def as_dict(self) -> dict[str, str]:
        """Return the gap as plain data for JSON."""
        return {"text": self.sentence, "add": self.add, "to": self.to}


def risk(sentence: str, add: str = "", to: str = "") -> Gap:
    """Return a gap because of which the program may do harm."""
    return Gap(sentence, add, to, is_risk=True)


def group_gaps(gaps: Iterable[Gap]) -> list[str]:
    """Say in a line for each place what wasn't checked, and what to add there; last what nothing settles."""
    lines = []
    for place in (TOOL_FILE, MACHINE_FILE, JOB, ""):
        here = [gap for gap in gaps if gap.to == place]
        if here:
            what = "; ".join(dict.fromkeys(gap.sentence.partition(":")[0] for gap in here))
            adds = ", ".join(dict.fromkeys(gap.add for gap in here))
            lines.append(f"{what}: add {adds} to the {place}" if place else f"{what}: nothing settles it")
    return lines


@dataclass(frozen=True)
class Cause:
    """Findings of one code and severity: one thing to correct.

    Parameters
    ----------
    severity, code : of all of them
    count : how many there are, including those that aren't listed
    worst : the finding with the largest value; the first one where none has a value
    first : place of the first one along the path
    """

    severity: Severity
    code: str
    count: int
    worst: Finding
    first: Place

    def __str__(self) -> str:
        return f"{self.severity}: {self.line} [{self.code}]"

    @property
    def line(self) -> str:
        """Code, number, the worst fact with its places, and what to do."""
        fact, semicolon, remedy = self.worst.message.partition("; ")
        return f"{self.code} ({self.count}): {fact}{self._places()}{semicolon}{remedy}"

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
    """Group findings by code and severity; each finding without a place is a group of its own.

    Parameters
    ----------
    findings : in any order
    counts : how many there are by code, where not all are listed or some are listed twice; those that aren't
        listed are counted at the worst severity of the code

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
    """Sort findings by severity, place and code, then by falling value.

    Of findings with the same code, place and message only the worst is kept.
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
    """Check whether any finding is an error."""
    return any(f.severity is Severity.ERROR for f in findings)
