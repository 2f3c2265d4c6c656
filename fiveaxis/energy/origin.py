"""Findings about powers that aren't the machine's own."""

from __future__ import annotations

from fiveaxis.findings import Finding, Severity
from fiveaxis.machine import Machine, describe_powers


def power_findings(machine: Machine) -> tuple[Finding, ...]:
    """Report estimated and borrowed drives; none where all of them are the machine's own."""
    text = describe_powers(machine)
    if machine.bands:
        remedy = "state masses or motors in the machine's file, or measure the powers (fiveaxis calibrate)"
        return (Finding(Severity.WARNING, "powers-estimated", f"{text}; {remedy}"),)
    return (Finding(Severity.NOTE, "powers-borrowed", text),) if text else ()
