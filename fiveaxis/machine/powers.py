"""Powers of a machine whose drives nobody has measured: borrowed from another machine, or estimated."""

from __future__ import annotations

import re
from dataclasses import replace

from fiveaxis.machine.estimating import with_estimates
from fiveaxis.machine.files import load_machine
from fiveaxis.machine.model import Machine

# In place of a machine's name: estimates for all axes, whatever the machine's file states.
ESTIMATED = "estimated"
# Axes of another machine after its name: ``hayashi-640123:B=A,C=C``.
_LETTERS = re.compile(r"(?P<name>.+):(?P<pairs>[A-Z]=[A-Z](,[A-Z]=[A-Z])*)")


def with_powers(machine: Machine, drives: str | None = None) -> Machine:
    """Return a machine in which every axis has a drive.

    Parameters
    ----------
    drives : machine whose drives are borrowed, by name or file, if need be with the axis to take for an own
        one (``hayashi-640123:B=A``); ``estimated`` for estimates of all axes; by default missing drives are
        estimated

    Raises
    ------
    MachineError
        The other machine lacks an axis or its power.
    UnknownMachine
        There is no machine of that name.
    """
    if drives is None:
        return with_estimates(machine)
    if drives == ESTIMATED:
        kept = tuple(p for p in machine.provenance if not p.figure.endswith(" drive"))
        bare = tuple(replace(axis, drive=None) for axis in machine.axes)
        return with_estimates(replace(machine, axes=bare, provenance=kept))
    found = _LETTERS.fullmatch(drives)
    if found is None:
        return machine.with_drives_of(load_machine(drives))
    pairs = dict(pair.split("=") for pair in found["pairs"].split(","))
    return machine.with_drives_of(load_machine(found["name"]), pairs)


def lender_of(drives: str | None) -> str | None:
    """Return the name of the machine that `drives` borrows from; None if it borrows from none."""
    if drives is None or drives == ESTIMATED:
        return None
    found = _LETTERS.fullmatch(drives)
    return drives if found is None else found["name"]


def describe_powers(machine: Machine) -> str:
    """Say in a line which powers are estimated or borrowed; empty where all are the machine's own."""
    origins = {p.figure: p for p in machine.provenance}
    drives = {c: origins[f"{c} drive"] for c in machine.letters if f"{c} drive" in origins}
    parts = []
    if machine.bands:
        letters = ", ".join(machine.bands)
        sources = {drives[c].source.partition(", from ")[2] or "stated masses" for c in machine.bands}
        factors = sorted({high for _low, high in machine.bands.values()})
        spread = ", ".join(f"{_within(machine, factor)} by a factor of {factor:g}" for factor in factors)
        known = " and ".join(sorted(sources))
        parts.append(f"powers of {letters} are estimated from {known}, and may be wrong: {spread}")
    borrowed = [f"{c} from {p.borrowed}" for c, p in drives.items() if p.borrowed]
    if borrowed:
        parts.append(f"powers are borrowed: {', '.join(borrowed)}")
    return "; ".join(parts)


def _within(machine: Machine, factor: float) -> str:
    return " ".join(letter for letter, (_low, high) in machine.bands.items() if high == factor)
