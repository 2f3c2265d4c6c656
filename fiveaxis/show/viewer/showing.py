"""A program as it is, all of its operations, to be shown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fiveaxis.base import (
    FiveAxisError,
    Meshes,
    Progress,
    Reading,
    Workpiece,
    keywords_of,
    unheard,
)
from fiveaxis.check import (
    DEFAULT_TOLERANCES,
    Against,
    Clearances,
    Fixture,
    Standing,
    Surroundings,
    check_program,
    placed_program,
)
from fiveaxis.lab import Pricing, price_program
from fiveaxis.model import (
    Machine,
    Tool,
    parse_tool,
    take_machine,
    tools_by_number,
    unknown_figures,
    with_powers,
)
from fiveaxis.nc import (
    RAPID,
    ProgramReading,
    kind_of,
    list_operations,
    load_source,
    operation_readings,
    set_up_as_stated,
)
from fiveaxis.show.viewer.shown import ShownOperation, WholeProgram

# What is said of `ReadMotion.on_part`.
AT_PART = (
    "words of the axes count from the part's zero, so that they are the tip's with all rotary axes at 0, as "
    "the program doesn't say where its zero is; say it (--zero)"
)
# mm, from the gauge point: tools that nobody has measured are shown so long.
SHOWN_LENGTH = 150.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Showing(Workpiece, Meshes, Reading):
    """All that `show_program` takes as keywords: tools, workpiece, how the program is read."""

    tool: Tool | str | None = None
    fixtures: tuple[Fixture, ...] = ()
    clearances: Clearances | None = None
    progress: Progress = unheard


@keywords_of(Showing)
def show_program(program: str | Path, machine: Machine | str | Path, given: Showing) -> WholeProgram:
    """Read an NC program as it is, all of its operations, to be shown: `preview`, `write_preview`.

    What a simulation needs and nobody states is assumed, and said in `WholeProgram.assumed`: speeds of rapid
    moves, a cutter, how long the tool is, axis powers. An operation that can't be read is left out, and said
    there, too.

    Parameters
    ----------
    program : in any language that `read_program` knows
    machine : on which it runs, or its name or file
    tool : the cutter of all operations, or its short form (``ball:6``); of several their short forms by their
        numbers, ``3=ball:6,5=bull:10:2``; by default as the program's comments state them
    fixtures : clamps and vices, workpiece frame
    clearances : mm, by kind of body
    progress : called with what is being done, steps done and steps in all

    Returns
    -------
    Its moves in the control's time, with the findings of `verify_program` in each operation

    Raises
    ------
    FiveAxisError
        As `read_program`, if no operation can be read; a file that is no program; as `Surroundings.of`.
    """
    around = Surroundings.of(given, given, given.fixtures, given.clearances)
    return show_operations(program, take_machine(machine), given, around)


def show_operations(
    program: str | Path, machine: Machine, given: Showing, around: Surroundings
) -> WholeProgram:
    """Read a program as `show_program` does, with its surroundings loaded."""
    source = load_source(program)
    if kind_of(source) != "program":
        raise source.error(
            "is no NC program; `fiveaxis optimise -o OUT` leaves a preview of its result, and a job .toml is "
            "run and shown by `fiveaxis preview`"
        )
    machine = machine if machine.has_powers else with_powers(machine)
    machine, reading, assumed = _assumed(machine, Reading.of(given))
    listed = list_operations(source, ProgramReading.of(replace(reading, operation=None), machine=machine))
    turning = next((o.number for o in listed if o.kind == "simultaneous" and o.tcp), None)
    if turning is None:
        machine, _ = set_up_as_stated(machine, source)
    else:
        machine, told = placed_program(source, machine, replace(reading, operation=turning), None)
        assumed += [finding.message for finding in told if finding.code == "part-placed"]
    tools = _tools(given.tool)
    parts, faults, standings = [], list[FiveAxisError](), list[Standing]()
    each = operation_readings(source, machine, reading)
    for number, (operation, own) in enumerate(each):
        given.progress("reading and verifying the program", number, len(each))
        try:
            priced = price_program(source, machine, Pricing.of(own))
        except FiveAxisError as fault:
            where = "" if operation is None else f"operation {operation.number}, {operation}: "
            assumed.append(f"{where}not shown, as it can't be read: {fault}")
            faults.append(fault)
            continue
        motion = priced.motion.on_part
        if motion.zero_unknown and not motion.tcp.all() and AT_PART not in assumed:
            assumed.append(AT_PART)
        name = "" if motion.operation is None else motion.operation.tool
        tool = tools.get(name, tools.get("")) or motion.tool
        against = Against(
            tool=tool,
            surroundings=None if tool is None else around,
            tolerances=DEFAULT_TOLERANCES.with_gouge(given.gouge_tolerance),
            surface_tolerance=given.surface_tolerance,
        )
        report = check_program(source, machine, against, own)
        if report.cut is not None:
            around = replace(around, blank=report.cut.following())
        standings += [] if report.standing is None else [report.standing]
        others = tuple(f for f in priced.findings if f.code not in report.counts)
        parts.append(ShownOperation(motion, priced.energy, name, tool, (*report.findings, *others)))
    if not parts:
        raise faults[0]
    table = max(standings, key=lambda each: each.height, default=None)
    # Nothing is cut here.
    around = replace(around, blank=None)
    return WholeProgram.of(source, machine, parts, around, table, tuple(assumed))


def _tools(given: Tool | str | None) -> dict[str, Tool]:
    """Return the given cutters by their numbers in the program, under an empty one a cutter for all."""
    if given is None or isinstance(given, Tool):
        return {} if given is None else {"": given}
    return {number: parse_tool(name) for number, name in tools_by_number(given).items()}


def _assumed(machine: Machine, reading: Reading) -> tuple[Machine, Reading, list[str]]:
    """Assume what a simulation needs and nobody states, and say so."""
    said = []
    if any(figure.name == "tool_length" for figure in unknown_figures(machine)):
        machine = machine.with_tool_length(SHOWN_LENGTH)
        said.append(
            f"tools are taken to be {SHOWN_LENGTH:g} mm long from the gauge point, on which the linear axes "
            f"depend on machine {machine.name!r}; say how long they are (--tool-length)"
        )
    untimed = ", ".join(axis.letter for axis in machine.axes if axis.max_speed is None)
    if untimed and reading.rapid is None:
        reading = replace(reading, rapid=RAPID)
        said.append(
            f"rapid moves of {untimed} run at {RAPID:,.0f} mm/min or deg/min, as machine {machine.name!r} "
            "states no highest speed of them; say how fast they are (--rapid)"
        )
    return machine, reading, said
