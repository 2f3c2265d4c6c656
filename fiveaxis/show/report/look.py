"""A program as it is: what each operation takes, which can be improved, and where it is slow and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fiveaxis.base import (
    STAGES,
    Cause,
    Finding,
    FiveAxisError,
    Progress,
    Reading,
    group_findings,
    keywords_of,
    unheard,
)
from fiveaxis.check import placed_program
from fiveaxis.lab import Pricing, SlowPlace, late_times, price_program, slow_places
from fiveaxis.model import (
    QUESTIONS,
    Energy,
    Machine,
    load_machine,
    tools_by_number,
    unknown_figures,
    with_powers,
)
from fiveaxis.nc import (
    RAPID,
    OperationFacts,
    ProgramReading,
    load_source,
    measure_operations,
    why_it_stays,
)


@dataclass(frozen=True)
class Missing:
    """A figure that the machine doesn't state.

    Parameters
    ----------
    name : of the question, as ``--assume`` has it: ``A.points``, ``X.speeds``; ``tool_length`` and ``rapid``
        are the job's
    text : what it is
    form : of an answer, with its unit
    """

    name: str
    text: str
    form: str


@dataclass(frozen=True, eq=False)
class OperationLook:
    """An operation as it is.

    Parameters
    ----------
    facts : lines, kind, tool, cut
    energy : time, energy, starts and reversals of the feed drives; None where its lines don't say them
    lost : s, by which its blocks take longer than F says
    slow : places where it is slow, the costliest first
    stays : why its postures can't be improved; empty where they can
    fault : why there is no energy
    findings : of reading and pricing it
    """

    facts: OperationFacts
    energy: Energy | None
    lost: float
    slow: tuple[SlowPlace, ...]
    stays: str
    fault: str
    findings: tuple[Finding, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return self.facts.as_dict() | {
            "energy": None if self.energy is None else self.energy.as_dict(),
            "lost": self.lost,
            "slow": [place.as_dict() for place in self.slow],
            "stays": self.stays or None,
            "fault": self.fault or None,
        }


@dataclass(frozen=True, eq=False)
class ProgramLook:
    """A program as it is on a machine.

    Parameters
    ----------
    program : its file
    machine : with the powers that were used
    operations : in the program's order
    missing : what the machine doesn't state, and something depends on
    assumed : what was taken in its place, in words
    """

    program: str
    machine: Machine
    operations: tuple[OperationLook, ...]
    missing: tuple[Missing, ...]
    assumed: tuple[str, ...]

    @property
    def summary(self) -> tuple[Cause, ...]:
        """The findings of all operations by cause."""
        return group_findings([finding for each in self.operations for finding in each.findings])

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {
            "program": self.program,
            "machine": self.machine.name,
            "operations": [each.as_dict() for each in self.operations],
            "missing": [vars(each) for each in self.missing],
            "assumed": self.assumed,
            "summary": [cause.as_dict() for cause in self.summary],
        }


@dataclass(frozen=True, kw_only=True)
class Looking(Reading):
    """All that `look` takes as keywords."""

    tool: str | None = None
    tool_length: float | None = None
    drives: str | None = None
    progress: Progress = unheard


@keywords_of(Looking)
def look(program: str | Path, machine: str | Path | Machine, given: Looking) -> ProgramLook:
    """Look at a program as it is: operations, time, energy, starts and reversals, slow places.

    Parameters
    ----------
    program : of any control that is read
    machine : that it was written for, or its name or file
    tool : ``ball:6``, or ``3=ball:6,5=bull:10:2`` by numbers, where its comments don't say it
    tool_length : mm, from the spindle's gauge point to the tip
    drives : machine whose axis powers are used; by default its own, or else ``estimated``
    progress : called with what is being done, steps done and steps in all

    Raises
    ------
    FiveAxisError
        No machine, or a file that is no program.
    """
    used = machine if isinstance(machine, Machine) else load_machine(str(machine))
    if given.tool_length is not None:
        used = used.with_tool_length(given.tool_length)
    missing, assumed, drives = tuple(_missing(used, given)), [], given.drives
    if drives is None and not used.has_powers:
        drives = "estimated"
        assumed.append("axis powers: estimated from the machine's size; compare joules, nothing more")
    powered = with_powers(used, drives)
    if any(each.name == "rapid" for each in missing):
        assumed.append(f"rapid speed: {RAPID:g} mm/min (deg/min)")
    reading, source = replace(given, rapid=given.rapid or RAPID), load_source(program)
    given.progress(STAGES["read"], 0, 1)
    facts = measure_operations(program, ProgramReading.of(reading, machine=used))
    named = {} if given.tool is None else tools_by_number(given.tool)
    cutters = [named.get(each.operation.tool) or named.get("") or each.cutter for each in facts]
    stay = [why_it_stays(each.operation, cutter) for each, cutter in zip(facts, cutters, strict=True)]
    # The part stands where a run that revises the program would have it.
    able = [n for n, each in enumerate(facts) if each.operation.kind == "simultaneous" and each.operation.tcp]
    first = min(able, key=lambda n: (bool(stay[n]), n), default=None)
    stands: tuple[Finding, ...] = ()
    if first is not None:
        its_own = replace(reading, operation=facts[first].operation.number)
        powered, stands = placed_program(source, powered, its_own, cutters[first])
    found = []
    for number, (each, stays) in enumerate(zip(facts, stay, strict=True)):
        given.progress("timing operations", number, len(facts))
        at = each.operation
        try:
            priced = price_program(source, powered, Pricing.of(Reading.of(reading), operation=at.number))
        except FiveAxisError as fault:
            found.append(OperationLook(each, None, 0.0, (), stays, str(fault), each.findings))
            continue
        lost, slow = float(late_times(priced).sum()), tuple(slow_places(priced))
        findings = (*stands, *priced.findings) if number == first else priced.findings
        found.append(OperationLook(each, priced.energy, lost, slow, stays, "", findings))
    return ProgramLook(source.name, powered, tuple(found), missing, tuple(assumed))


def _missing(machine: Machine, given: Looking) -> Iterator[Missing]:
    forms = {question.name: question for question in QUESTIONS}
    for figure in unknown_figures(machine):
        letter, _, question = figure.name.rpartition(".")
        form = forms[question].form_of(letter) if question in forms else "mm"
        yield Missing(figure.name, figure.text, form)
    for axis in machine.axes:
        if axis.max_speed is None:
            name, form = f"{axis.letter}.speeds", forms["speeds"].form_of(axis.letter)
            yield Missing(name, f"how fast {axis.letter} can move", form)
    if given.rapid is None and any(axis.max_speed is None for axis in machine.axes if not axis.is_rotary):
        yield Missing("rapid", "how fast rapid moves are", "mm/min")
