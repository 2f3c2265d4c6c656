"""What of two verdicts keeps a job's program back, and which of it the job accepts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fiveaxis.findings import Finding, Severity
from fiveaxis.nc.gate import error_counts
from fiveaxis.verification import Report


@dataclass(frozen=True)
class Gate:
    """Whether a program may be written.

    Parameters
    ----------
    report : what was found at the solution's locations and in the program's blocks
    accepted : codes of errors that occurred and are accepted by name
    kept : count of what isn't, by code
    unused : findings about codes that are accepted and didn't occur
    """

    report: Report
    accepted: tuple[str, ...]
    kept: dict[str, int]
    unused: tuple[Finding, ...]

    @property
    def is_open(self) -> bool:
        """Whether nothing keeps the program back."""
        return not self.kept


def make_gate(locations: Report, blocks: Report, override: Sequence[str]) -> Gate:
    """Put the verdicts on a solution's locations and on its program's blocks together.

    Parameters
    ----------
    locations : errors count; that the tool leaves its way between locations doesn't, as the program has
        more of them
    blocks : every error counts, leaving the way between blocks too
    override : codes of errors that are accepted
    """
    report = joined(locations, blocks)
    errors = error_counts(report)
    return Gate(
        report=report,
        accepted=tuple(code for code in override if code in errors),
        kept={code: count for code, count in errors.items() if code not in override},
        unused=tuple(
            Finding(Severity.WARNING, "override-unused", f"override accepts {code}, which wasn't found")
            for code in override
            if code not in errors
        ),
    )


def joined(locations: Report, blocks: Report) -> Report:
    """Make one report of two on the same path: of each code the larger count."""
    errors = tuple(f for f in locations.findings if f.severity is Severity.ERROR)
    codes = sorted({f.code for f in errors} | set(blocks.counts))
    counts = {
        code: max(blocks.counts.get(code, 0), locations.counts[code] if _has(errors, code) else 0)
        for code in codes
    }
    return replace(
        blocks,
        findings=(*errors, *blocks.findings),
        counts=counts,
        checked=tuple(dict.fromkeys((*locations.checked, *blocks.checked))),
        not_checked=tuple(dict.fromkeys((*locations.not_checked, *blocks.not_checked))),
    )


def _has(findings: Sequence[Finding], code: str) -> bool:
    return any(f.code == code for f in findings)
