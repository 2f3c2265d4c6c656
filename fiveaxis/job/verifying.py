"""Verify an NC program or the table of a motion, from any source, and show a program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fiveaxis.base import (
    Bounds,
    FiveAxisError,
    Meshes,
    ProgramBounds,
    Progress,
    Reading,
    Workpiece,
    keywords_of,
    unheard,
    with_default,
)
from fiveaxis.check import (
    DEFAULT_TOLERANCES,
    Against,
    Clearances,
    Fixture,
    Report,
    Standing,
    Surroundings,
    Tolerances,
    check_program,
)
from fiveaxis.job.look import standing
from fiveaxis.lab import Pricing, price_program
from fiveaxis.model import (
    Constraints,
    Machine,
    Tool,
    Toolpath,
    parse_tool,
    take_machine,
    tools_by_number,
    unknown_figures,
    with_powers,
)
from fiveaxis.nc import (
    RAPID,
    ProgramOptions,
    ProgramReading,
    ProgramSettings,
    kind_of,
    list_operations,
    load_source,
    operation_readings,
    set_up_as_stated,
)
from fiveaxis.show import ShownOperation, WholeProgram

# What is said of `ReadMotion.on_part`.
AT_PART = (
    "words of the axes count from the part's zero, so that they are the tip's with all rotary axes at 0, as "
    "the program doesn't say where its zero is; say it (--zero)"
)
# mm, from the gauge point: tools that nobody has measured are shown so long.
SHOWN_LENGTH = 150.0
# deg and deg/mm: turns of a program that are told, within this angle of the first rotary axis.
SINGULAR_CONE, SINGULAR_RATE = 5.0, 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Checking(Workpiece, ProgramBounds, Meshes, Reading):
    """All that `verify_program` takes as keywords: workpiece, bounds, how files are read."""

    tool: Tool | None = None
    toolpath: Toolpath | None = None
    fixtures: tuple[Fixture, ...] = ()
    clearances: Clearances | None = None
    tolerances: Tolerances = DEFAULT_TOLERANCES
    settings: ProgramSettings | None = None
    control: str | Path | None = None
    singular_cone: float | None = with_default(ProgramBounds, "singular_cone", SINGULAR_CONE)
    singular_rate: float = with_default(ProgramBounds, "singular_rate", SINGULAR_RATE)

    @property
    def bounds(self) -> Bounds:
        """The bounds that are checked; the rate is that of a cone."""
        return Bounds.of(self) if self.singular_cone is not None else Bounds.of(self, singular_rate=0.0)


@keywords_of(Checking)
def verify_program(
    program: str | Path,
    machine: Machine,
    given: Checking,
) -> Report:
    """Check an NC program, or the table of a motion, against its machine; part and path are optional.

    Bounds of postures are in **degrees**: tilt, lead and lean relative to the surface normals of
    `toolpath`, or else to those of the part, a cone about the axes of `toolpath`. Without `singular_cone`,
    fast turns within `SINGULAR_CONE` are told.

    Between two blocks all axes run linearly in time; moves under TCP are first split into parts in which such
    axes keep the tip on its path. Between two rows of a motion's table the tool's centre moves in a straight
    line. Anywhere in a program the cutter may reach 0.015 mm deeper than `gouge_tolerance`, since its blocks
    are chords of the path within a tolerance of their own. A program that doesn't state the axis values is
    checked as a path of the tool, with the finding ``angles-assumed``.

    Parameters
    ----------
    program : in any language that `read_program` knows, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    tool : the cutter; by default that of `toolpath`, or as the program's comments state it. Without a tool
        only the tip is followed
    toolpath : that the program should follow: its tool's centre keeps to the path within
        `Tolerances.deviation` and passes all of its locations in order
    fixtures : clamps and vices, workpiece frame, that cutter, shank, holder and machine keep clear of
    clearances : mm, by kind of body
    tolerances : from where on any other difference is a finding
    settings : of the program that was asked for: spindle, tool, offsets and coolant have to be in force in
        every cut
    control : of the program, unless its header names one, and whose words the settings are, as for
        `compose_program`; by default the machine's

    Returns
    -------
    Findings with file and line of the program: ``not-finite``, ``axis-limit``, ``held-axis``, ``tilt``,
    ``gouge``, ``…-collision``, ``off-path``, ``path-missed`` (errors), ``jump`` (an error; a warning where
    the swept cutter was checked for gouges and no bound was given), ``feed-over``, ``singular-turn``,
    ``…-clearance``, ``tip-deviation`` (warnings: a control slows down, and what lies between the blocks of
    somebody else's program is its author's choice), and what was assumed while reading it.

    Raises
    ------
    FiveAxisError
        As `read_program`, `verify` and `find_contacts`; bounds that refer to a path or part that isn't given.
    """
    machine, required = machine.with_control(given.control), None
    if given.settings is not None:
        required = ProgramOptions(control=given.control, settings=given.settings).on(machine)
    against = Against(
        given.toolpath,
        given.tool,
        Surroundings.of(given, given, given.fixtures, given.clearances),
        Constraints.of(given.bounds),
        program=required,
        part_unit=given.part_unit or "mm",
        crease=given.crease,
    )
    allowed = given.tolerances.with_gouge(given.gouge_tolerance)
    return check_program(program, machine, against, given, given.surface_tolerance, allowed)


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
        As `read_program`, if no operation can be read; a file that is no program; as `Surroundings.load`.
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
        machine, told = standing(source, machine, replace(reading, operation=turning), None)
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
        against = Against(None, tool, None if tool is None else around, gouge_tolerance=given.gouge_tolerance)
        report = check_program(source, machine, against, own, given.surface_tolerance)
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
    return WholeProgram.of(source.name, machine, source.lines, parts, around, table, tuple(assumed))


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
