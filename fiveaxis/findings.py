"""Findings: what a check has to say about a path, place by place.

A finding is data, not an exception: a path with a thousand bad places has a thousand findings. Codes are
stable, so scripts may depend on them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any


class Severity(StrEnum):
    """How bad a finding is, by its consequence on the machine."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


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


def count_codes(findings: Iterable[Finding]) -> dict[str, int]:
    """Count findings by code, sorted by code."""
    return dict(sorted(Counter(f.code for f in findings).items()))


def has_errors(findings: Iterable[Finding]) -> bool:
    """Tell whether any finding must keep the path off a machine."""
    return any(f.severity is Severity.ERROR for f in findings)
