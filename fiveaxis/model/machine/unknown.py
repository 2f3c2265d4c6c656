"""What nobody has stated of a machine, and the words of a program on which it acts: unknown is never zero."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, Coordinates, Finding, MachineError, Severity
from fiveaxis.model.machine.measuring import gauge_unknown, pivots_unknown
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.provenance import Provenance

# rad: rotary axes that turn by less stay at 0.
STANDING = 1e-9
# Begins the note of a figure that was assumed for one run.
ASSUMED = "assumed for this run"


@dataclass(frozen=True)
class Unknown:
    """A figure that nobody has stated.

    Parameters
    ----------
    name : as ``--assume`` has it, ``B.points``; the tool's length is the job's
    option : that states it
    text : what it is
    acts : coordinates of a program whose tool goes elsewhere with another figure
    """

    name: str
    option: str
    text: str
    acts: tuple[Coordinates, ...]


def unknown_figures(machine: Machine) -> tuple[Unknown, ...]:
    """List what isn't stated of a machine and moves its tool.

    Lines of rotary axes: all but that of the table's first one, at which the zero of the machine frame is
    chosen. Where the gauge point is matters where a rotary axis carries the tool; elsewhere the work offset
    takes it up.
    """
    chosen = next((c for c in machine.code.table if c in "ABC"), "")
    found = [
        Unknown(f"{c}.points", f"--assume {c}.points=X,Y,Z", f"where the line of {c} is", ("axes",))
        for c in pivots_unknown(machine, or_assumed=False)
        if c != chosen
    ]
    for c in machine.letters:
        if machine.axis(c).reversed is None:
            option = f"--assume {c}.counts=tool (or table)"
            found.append(Unknown(f"{c}.counts", option, f"in which sense {c} counts", ("axes", "tip")))
    if gauge_unknown(machine):
        text = "where the spindle's gauge point is, from which the pivots of its head count"
        found.append(Unknown("spindle", "--assume spindle=X,Y,Z", text, ("axes",)))
    if machine.rotaries and not (machine.length_is_along_z or machine.has_tool_length):
        text = "how long the tool is from the gauge point"
        found.append(Unknown("tool_length", "--tool-length", text, ("axes",)))
    return tuple(found)


def assumed_figures(machine: Machine) -> list[Provenance]:
    """List the figures that are assumed for one run."""
    return [p for p in machine.provenance if p.assumed and p.note.startswith(ASSUMED)]


def require_stated(machine: Machine, coordinates: Coordinates, positions: Array | None = None) -> None:
    """Raise `MachineError` unless each figure is stated on which words depend, as for `figure_findings`."""
    for finding in figure_findings(machine, coordinates, positions):
        if finding.severity is Severity.ERROR:
            raise MachineError(finding.message)


def figure_findings(
    machine: Machine, coordinates: Coordinates, positions: Array | None = None
) -> Iterator[Finding]:
    """Yield what isn't stated of a machine, and what was assumed for this run.

    Parameters
    ----------
    coordinates : of the program's words
    positions : (n, k), mm and rad, of its axes. Where all rotary axes stay at 0, no figure acts: an upright
        tool's tip goes with the linear axes. None where it isn't known yet

    Returns
    -------
    ``figure-unknown``, an error where the figure acts on the tool's motion and a warning where it acts on the
    computed travel, limits and energy only; ``figure-assumed``, a warning
    """
    if positions is not None and not np.any(np.abs(positions[:, machine.rotary_columns]) > STANDING):
        return
    of = f"machine {machine.name!r}"
    for figure in unknown_figures(machine):
        if coordinates in figure.acts:
            yield Finding(
                Severity.ERROR,
                "figure-unknown",
                f"{of} doesn't state {figure.text}, and the tool's motion depends on it; measure it "
                f"(`fiveaxis info {machine.name}` shows what) and state it in the machine file, or give "
                f"{figure.option}",
            )
        else:
            yield Finding(
                Severity.WARNING,
                "figure-unknown",
                f"{of} doesn't state {figure.text}: the control knows it, so the tool's path is right, but "
                "travel, limits and energy of the linear axes are computed without it",
            )
    for p in assumed_figures(machine):
        text = f"{p.figure} of {of}: {p.value}, {p.note}; measure it before the program runs"
        yield Finding(Severity.WARNING, "figure-assumed", text)
