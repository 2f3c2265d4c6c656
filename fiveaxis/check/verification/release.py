"""The release gate: no program is written with errors in its report that nobody has accepted by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from fiveaxis.base import Finding, SettingError, Severity, Unverified, require_codes
from fiveaxis.check.verification.report import Report
from fiveaxis.model import Machine, Motion, motion_digest
from fiveaxis.nc import NOT_VERIFIED, table_comment

NOTHING_TO_VERIFY = (
    "the program isn't verified: a motion alone doesn't say which path it should follow, with which tool and "
    "around which part; give them (against), or set unverified=True"
)
# Name of the header's comment for each code that was accepted.
OVERRIDDEN = "OVERRIDDEN"


@dataclass(frozen=True)
class Gate:
    """Whether a program may be written.

    Parameters
    ----------
    report : what verification found in the program's text
    accepted : codes of errors that occurred and are accepted by name
    kept : number of errors that aren't accepted, by code; they keep the program back
    unused : findings about accepted codes that didn't occur
    verified : whether the report rests on checks of the text
    """

    report: Report
    accepted: tuple[str, ...] = ()
    kept: dict[str, int] = field(default_factory=dict)
    unused: tuple[Finding, ...] = ()
    verified: bool = True

    @classmethod
    def unverified(cls) -> Gate:
        """Make the gate of a program that there is nothing to verify against."""
        return cls(Report.of_findings(()), verified=False)

    @classmethod
    def of(cls, report: Report, override: Sequence[str] = ()) -> Gate:
        """Make the gate of a report and the codes that are accepted.

        Raises
        ------
        SettingError
            A code that doesn't exist, or isn't that of an error.
        """
        given = require_codes(override)
        found = {f.code for f in report.findings if f.severity is Severity.ERROR}
        errors = {code: count for code, count in report.counts.items() if code in found}
        return cls(
            report=report,
            accepted=tuple(code for code in given if code in errors),
            kept={code: count for code, count in errors.items() if code not in given},
            unused=tuple(
                Finding(Severity.WARNING, "override-unused", f"override accepts {code}, which wasn't found")
                for code in given
                if code not in errors
            ),
        )

    @property
    def is_open(self) -> bool:
        """Whether nothing keeps the program back."""
        return self.verified and not self.kept

    @property
    def notes(self) -> list[tuple[str, str]]:
        """Names and texts of the program's header: accepted errors, the verdict, the part over the table."""
        if not self.verified:
            return list(NOT_VERIFIED)
        codes = ", ".join(f"{code} ({self.report.counts[code]})" for code in self.accepted)
        accepted = [(OVERRIDDEN, codes)] if codes else []
        verdict = "errors accepted by name" if accepted else "no errors"
        risks = len(self.report.risks)
        told = f"; risks that weren't checked: {risks}, see the report" if risks else ""
        standing = self.report.standing
        table = [] if standing is None else [table_comment(standing.height, stated=standing.stated)]
        return [*accepted, ("verification", f"{verdict} in this text, read back{told}"), *table]

    def require_open(self, *, unverified: bool = False) -> None:
        """Raise unless the program may be written.

        Parameters
        ----------
        unverified : whether an unverified program may be written

        Raises
        ------
        Unverified
            An error that isn't accepted; an unverified program.
        """
        if not (self.verified or unverified):
            raise Unverified(NOTHING_TO_VERIFY, [])
        if self.kept:
            found = ", ".join(f"{code} ({count})" for code, count in self.kept.items())
            raise Unverified(
                f"verification of the program found {found}; no program is written; correct the path, or "
                "accept each code by name (override)",
                [f for f in self.report.findings if f.code in self.kept],
            )


def require_report(report: Report, motion: Motion, machine: Machine) -> None:
    """Raise `SettingError` unless a report is about a motion on a machine, with the same tool length."""
    if not isinstance(report, Report):
        raise SettingError(f"a {type(report).__name__} is no report; give the one that verification returns")
    if report.about is not None and report.about != motion_digest(motion, machine):
        raise SettingError(
            "the report is about another motion, or another machine or tool length; no program is written; "
            "verify the motion that is to be written, on its machine"
        )
