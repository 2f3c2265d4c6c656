"""The gate before NC: no program for a motion with errors that nobody has accepted by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from fiveaxis.codes import WORSE_IN_BLOCKS, require_codes
from fiveaxis.errors import SettingError, Unverified
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array

# What the header of a program says for which nobody gave a verdict.
NOT_VERIFIED = "NOT VERIFIED, nobody has checked limits, contact, gouges or collisions of this motion"

# What it says where nobody has checked what the writer puts around the moves.
NO_APPROACH = "the approach to the first location and the way out at the end, which the program adds"

# What it says before each code that was accepted.
OVERRIDDEN = "OVERRIDDEN"


class Verdict(Protocol):
    """What a verification found; `fiveaxis.verification.Report` is one."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Each with code, severity and place."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of violations by code, those that aren't listed included."""

    @property
    def checked(self) -> tuple[str, ...]:
        """Sentences that say what the verdict rests on."""

    @property
    def not_checked(self) -> tuple[str, ...]:
        """Sentences that say what it leaves open."""


def pass_gate(
    verdict: Verdict | None, override: Sequence[str] = (), *, led: bool = False, about: str | None = None
) -> list[tuple[str, str]]:
    """Let a motion pass, or say what keeps it back.

    Parameters
    ----------
    verdict : on the motion; None where nobody has verified it
    override : codes of errors that are accepted
    led : whether the control leads the tool's tip between blocks; else its axes run linearly
    about : `motion_digest` of the motion that is to be written; None for no comparison

    Returns
    -------
    What the program's header says, names and texts: each accepted error with its count, what was checked and
    what wasn't

    Raises
    ------
    Unverified
        An error that isn't accepted; a verdict on another motion.
    SettingError
        A code that doesn't exist or didn't occur; one to accept, and no verdict.
    """
    accepted = require_codes(override)
    if verdict is None:
        if accepted:
            raise SettingError("override accepts errors of a verification; give its report, too")
        return [("verification", NOT_VERIFIED)]
    found_about = getattr(verdict, "about", None)
    if about is not None and found_about is not None and about != found_about:
        raise Unverified(
            "the report is about another motion, or another machine or tool length; no program is written; "
            "verify the motion that is to be written, on its machine",
            [],
        )
    errors = error_counts(verdict, led=led)
    # What a control that leads the tip makes harmless may be accepted all the same.
    needless = WORSE_IN_BLOCKS if led else ()
    unused = [code for code in accepted if code not in errors and code not in needless]
    if unused:
        raise SettingError(f"override names {', '.join(unused)}, and verification found none; take it away")
    kept = {code: count for code, count in errors.items() if code not in accepted}
    if kept:
        found = ", ".join(f"{code} ({count})" for code, count in kept.items())
        raise Unverified(
            f"verification found {found}; no program is written; mend the path, or accept each code by name "
            "(override)",
            [f for f in verdict.findings if f.code in kept],
        )
    notes = [(OVERRIDDEN, f"{code} ({errors[code]})") for code in accepted if code in errors]
    notes.append(("verification", "errors accepted by name" if notes else "no errors"))
    notes += [("checked", text) for text in dict.fromkeys(verdict.checked)]
    left = (
        *verdict.not_checked,
        *_other_ways(verdict, led),
        *(() if checked_lead_in(verdict) is not None else (NO_APPROACH,)),
    )
    notes += [("not checked", text) for text in dict.fromkeys(left)]
    return notes


def _other_ways(verdict: Verdict, led: bool) -> list[str]:
    """Say what a verdict has looked for on another way between locations than the program's alone."""
    way, how = ("led", "the tip led straight") if led else ("axes", "all axes linear in time")
    checked = {what: getattr(verdict, f"{what}_between", None) for what in ("gouges", "collisions")}
    return [
        f"{what} between locations with {how}, as this program has it"
        for what, ways in checked.items()
        if ways is not None and way not in ways
    ]


def checked_lead_in(verdict: Verdict | None) -> Array | None:
    """Give the last way to the first location, (k,) mm back from there, that a verdict has checked.

    None where it has checked none.
    """
    return _checked_way(verdict, "lead_in")


def checked_lead_out(verdict: Verdict | None) -> Array | None:
    """Give the way off the last location, (k,) mm, that a verdict has checked; None where it has none."""
    return _checked_way(verdict, "lead_out")


def _checked_way(verdict: Verdict | None, name: str) -> Array | None:
    way = getattr(verdict, name, None)
    return None if way is None else np.array(way, dtype=float)


def error_counts(verdict: Verdict, *, led: bool = False) -> dict[str, int]:
    """Count what keeps a program's blocks back, by code, sorted.

    A control without tool centre point control does what the blocks say, so leaving the way between them is
    an error unless the control leads the tip.
    """
    errors = {f.code for f in verdict.findings if f.severity is Severity.ERROR}
    found = {f.code for f in verdict.findings}.intersection(WORSE_IN_BLOCKS)
    return {code: verdict.counts[code] for code in sorted(errors - found if led else errors | found)}
