"""A program whose simultaneous operations are revised in place, each by a run of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fiveaxis.base import (
    AlreadyBetter,
    Bounds,
    FiveAxisError,
    Infeasible,
    JobError,
    Meshes,
    Progress,
    Reading,
    ReadProgram,
    Search,
    Surrounding,
    keywords_of,
    unheard,
    within,
    write_atomically,
)
from fiveaxis.job.description import Job, Trade
from fiveaxis.job.in_place import timed_reading
from fiveaxis.job.loading import load_job_machine, operation_text, program_machine, revises
from fiveaxis.job.reading import make_job
from fiveaxis.job.setup_choice import run_job
from fiveaxis.job.stages import Outcome
from fiveaxis.job.task import resolve
from fiveaxis.lab import Pricing, price_program
from fiveaxis.model import Energy, Machine, Operation, tools_by_number
from fiveaxis.nc import (
    STAND_IN,
    OperationText,
    ProgramReading,
    Source,
    list_operations,
    load_source,
    revised,
    stated_tools,
    why_it_stays,
    with_lines,
)

NOT_CHOSEN = "it wasn't chosen"


@dataclass(frozen=True, eq=False)
class Part:
    """An operation of a program, and what became of it.

    Parameters
    ----------
    operation : as the program states it
    outcome : of its run; None where its lines stay
    why : they stay
    priced : time and energy of lines that stay; None where they don't say it
    better : its own postures are; None where they were replaced, or weren't looked at
    """

    operation: Operation
    outcome: Outcome | None = None
    why: str = ""
    priced: Energy | None = None
    better: AlreadyBetter | None = None

    @property
    def before(self) -> Energy | None:
        """Time and energy of its lines as it was, approach and retract included."""
        return self.priced if self.outcome is None else self.outcome.original

    @property
    def after(self) -> Energy | None:
        """The same, now."""
        return self.priced if self.outcome is None else self.outcome.solution.energy

    @property
    def verdict(self) -> str:
        """In a word: ``better``, a ``trade``, ``needed``, ``already better``, or that it ``stays``."""
        if self.outcome is None:
            return "stays" if self.better is None else "already better"
        if (chosen := self.outcome.chosen) is None:
            return "better"
        return "needed" if chosen.comparison.faults else "trade" if chosen.comparison.trades else "better"

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        made = self.outcome
        return {
            **self.operation.as_dict(),
            "verdict": self.verdict,
            "stays": self.why or None,
            "verified": None if made is None else made.ok,
            "answers": None if made is None else made.report.answers.as_dict(),
            "energy_before": None if self.before is None else self.before.as_dict(),
            "energy": None if self.after is None else self.after.as_dict(),
        }


@dataclass(frozen=True, eq=False)
class RevisedProgram:
    """A program of which some operations have new postures.

    Parameters
    ----------
    source : the program as it was
    parts : all its operations, in order
    """

    source: Source
    parts: tuple[Part, ...]

    @property
    def outcomes(self) -> dict[int, Outcome]:
        """The runs of the revised operations, by number."""
        return {p.operation.number: p.outcome for p in self.parts if p.outcome is not None}

    @property
    def ok(self) -> bool:
        """Whether nothing keeps the program back."""
        return all(outcome.gate.is_open for outcome in self.outcomes.values())

    @property
    def verdict(self) -> str:
        """In a word: a ``trade`` if an operation is one, ``better``, ``already better`` if none changes."""
        found = {part.verdict for part in self.parts}
        return next(
            word for word in ("trade", "needed", "better", "already better", "stays") if word in found
        )

    @cached_property
    def replaced(self) -> Mapping[int, tuple[str, ...]]:
        """The new lines in place of those of the program."""
        lines: dict[int, tuple[str, ...]] = {}
        for outcome in self.outcomes.values():
            lines |= {} if outcome.revision is None else outcome.revision.replaced
        return lines

    @cached_property
    def data(self) -> bytes:
        """The bytes of the new program."""
        return with_lines(self.source, self.replaced)

    def write(self, path: str | Path) -> Path:
        """Write the new program, whole or not at all.

        Raises
        ------
        Unverified
            An operation has an error that isn't accepted.
        SettingError
            The file can't be written.
        """
        for outcome in self.outcomes.values():
            outcome.gate.require_open()
        return write_atomically(path, self.data)

    def as_dict(self) -> dict[str, Any]:
        """Return all operations as plain data for JSON."""
        return {
            "program": self.source.name,
            "verdict": self.verdict,
            "operations": [part.as_dict() for part in self.parts],
        }


@dataclass(frozen=True, kw_only=True)
class Revising(Reading, Search, Meshes, Surrounding, Bounds):
    """All that `revise_program` takes as keywords: within what, and how the program is read."""

    tool: str | None = None
    tool_length: float | None = None
    drives: str | None = None
    output: str | Path | None = None
    allow: Sequence[Trade] = ()


@keywords_of(Revising)
def revise_program(
    program: str | Path,
    machine: str | Path,
    given: Revising,
) -> RevisedProgram:
    """Give operations of a program new postures in its own lines, as `fiveaxis optimise` does.

    Parameters
    ----------
    program : of any control that is written; its other lines stay byte for byte
    machine : name or file of the one that it was written for
    tool : ``ball:6``; of several ``3=ball:6,5=bull:10:2``, by their numbers; by default as comments say
    tool_length : mm, from the spindle's gauge point to the tip
    drives : machine whose axis powers are used, or ``estimated``
    output : file of the new program; by default none is written, nor where nothing is better
    allow : what a cheaper operation may be worse in: ``slower``, ``rougher``

    Raises
    ------
    JobError
        No operation can be revised, with the reason of each.
    Unverified
        With `output`: an operation has an error that isn't accepted.
    FiveAxisError
        What can't be read, or be put into the program's own words.
    """
    reading = vars(ReadProgram.of(given))
    settings = {name: value for name, value in vars(given).items() if name not in {*reading, "output"}}
    settings |= {"input": Path(program), "machine": str(machine), "program": reading}
    made = revise_operations(make_job(**settings | {"allow": tuple(given.allow)}))
    if given.output is not None and made.outcomes:
        made.write(given.output)
    return made


def revise_operations(job: Job, progress: Progress = unheard) -> RevisedProgram:
    """Revise every simultaneous operation of a job's program whose tool is known, or those that it names.

    The job's tool may name cutters by their numbers, ``3=ball:6,5=bull:10:2``; else the program's
    comments do.

    Raises
    ------
    JobError
        No operation can be revised, with the reason of each.
    Infeasible
        Likewise, and every one that was tried has locations without a posture.
    FiveAxisError
        Operations that can't be put into one text.
    """
    source = load_source(job.input)
    operations = operations_of(job)
    if (last := max(_chosen(job), default=0)) > len(operations):
        raise JobError(f"has no operation {last}; it holds {len(operations)}", file=job.input)
    tools = _tools(job, source, operations)
    simultaneous = {operation.tool for operation in operations if operation.kind == "simultaneous"}
    for name in tools if job.tool is not None else ():
        if name and name not in simultaneous:
            raise JobError(
                f"tool {name}={tools[name]}: no simultaneous operation has tool {name}; there are "
                f"{', '.join(sorted(simultaneous)) or 'none'}",
                file=job.input,
            )
    tool_of = {o.number: tools.get(o.tool, tools.get("")) for o in operations}
    asked = _chosen(job) or tool_of
    reasons = {
        o.number: why_it_stays(o, tool_of[o.number]) if o.number in asked else NOT_CHOSEN for o in operations
    }
    chosen = [number for number, why in reasons.items() if not why]
    # The part stands where the first operation that is revised has it, in all of them.
    if chosen:
        first = _of(job, chosen[0], tool=tool_of[chosen[0]])
        job = job.model_copy(update={"setup": resolve(first).job.setup})
    machine = load_job_machine(job)
    parts, faults, begun = [], list[FiveAxisError](), 0
    for operation in operations:
        number, better, outcome = operation.number, None, None
        why = reasons[number]
        if not why:
            of_one = within(progress, f"operation {number} of {len(operations)}", begun, len(chosen))
            begun += 1
            try:
                outcome = run_job(_of(job, number, tool=tool_of[number]), of_one)
            except AlreadyBetter as kept:
                why, better = str(kept), kept
            except FiveAxisError as fault:
                if len(operations) == 1:
                    raise
                why = str(fault)
                faults.append(fault)
        priced = None if outcome is not None else _price(source, machine, job, number)
        parts.append(Part(operation, outcome, why, priced, better))
    made = RevisedProgram(source, tuple(parts))
    if not made.outcomes and not any(part.better for part in parts):
        looked_at = [p for p in parts if p.why != NOT_CHOSEN]
        each = "".join(f"\n  {p.operation.number}: {p.operation}: {p.why}" for p in looked_at)
        without = [fault for fault in faults if isinstance(fault, Infeasible)]
        if without and len(without) == len(faults):
            findings = [finding for fault in without for finding in fault.findings]
            raise Infeasible(f"{job.input}: no operation can be revised:{each}", findings)
        raise JobError(f"no operation can be revised:{each}", file=job.input)
    _require_together(job, made)
    return made


def takes_operations(job: Job) -> bool:
    """Check whether a job's program is revised operation by operation, or has to say which tool cuts."""
    if not revises(job):
        return False
    if job.tool is None or "=" in job.tool or len(_chosen(job)) > 1:
        return True
    return not _chosen(job) and len(operations_of(job)) > 1


def operations_of(job: Job) -> tuple[Operation, ...]:
    """List the operations of a job's program, read as the job asks."""
    reading = ProgramReading.of(job.reading, operation=None, machine=program_machine(job))
    return list_operations(load_source(job.input), reading)


def _chosen(job: Job) -> tuple[int, ...]:
    """Return the numbers of the operations that a job names; none where it revises all."""
    table: Any = job.program
    numbers: tuple[int, ...] | None = table.operation
    return numbers or ()


def _tools(job: Job, source: Source, operations: Sequence[Operation]) -> dict[str, str]:
    """Return the cutters by their numbers in the program, under an empty one a cutter for every operation."""
    if job.tool is not None:
        return tools_by_number(job.tool)
    number = next((o.number for o in operations if o.kind == "simultaneous"), None)
    if number is None:
        return {}
    stated = stated_tools(source, operation_text(_of(job, number), STAND_IN).unit)
    return {tool: each.cutter for tool, each in stated.items()}


def _of(job: Job, number: int, **changes: Any) -> Job:
    program = job.program.model_copy(update={"operation": (number,)})
    return job.model_copy(update={"program": program, **changes})


def _price(source: Source, machine: Machine, job: Job, number: int) -> Energy | None:
    reading = Pricing.of(timed_reading(job, machine), operation=number)
    try:
        return price_program(source, machine, reading).energy if machine.has_powers else None
    except FiveAxisError:
        return None


def _require_together(job: Job, made: RevisedProgram) -> None:
    """Raise unless every revised operation is the same beside the others as alone."""
    text = revised(made.source, made.replaced)
    for number, outcome in made.outcomes.items():
        options = operation_text(_of(job, number), outcome.solution.toolpath.tool).options
        alone = OperationText.of(Source(text.name, list(outcome.program.text.lines)), options)
        beside = OperationText.of(text, options)
        if not beside.columns.same_moves(alone.columns).all():
            raise JobError(
                f"operation {number} isn't the same beside other revised operations; revise one at a time "
                "(--operation)",
                file=job.input,
            )
