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
    locations : on the solution's locations; the way between them is for `blocks` to check
    blocks : on the motion of the program's blocks
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
    """Make one report on a program of two on the same path; figures and ways are those of the blocks."""
    on_path = replace(locations, figures={}, about=None, gouges_between=None, collisions_between=None)
    return on_path.merge(blocks)
