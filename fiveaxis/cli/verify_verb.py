"""The command that verifies programs from any source."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.base import (
    CadFile,
    Meshes,
    OnMachine,
    Placing,
    ProgramBounds,
    Progress,
    Reading,
    ReadProgram,
    SettingError,
    Workpiece,
    group_findings,
    group_gaps,
)
from fiveaxis.cli.options import (
    ON_MACHINE,
    PLACING,
    PLANNING,
    POSTURE,
    PROGRAM_BOUNDS,
    READING,
    AsJson,
    flags_of,
    is_verbose,
    read_flags,
    takes,
)
from fiveaxis.cli.terminal import (
    err,
    errors_explained,
    out,
    print_causes,
    print_filled,
    print_json,
    print_table,
    require_machine,
)
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.base import Finding
    from fiveaxis.check import Against, Report, Surroundings
    from fiveaxis.job import Job
    from fiveaxis.model import Machine, Operation

# How the program itself is read.
PROGRAM: Mapping[str, Any] = {"unit": READING["unit"], **flags_of(ReadProgram)}
CHECKING: Mapping[str, Any] = {
    **{name: ON_MACHINE[name] for name in ("machine", "assume", "tool_length")},
    **PLACING,
    "tool": PLANNING["tool"],
    **flags_of(Meshes),
    **flags_of(Workpiece),
    **{name: POSTURE[name] for name in ("fixtures", "path_shape")},
    **PROGRAM_BOUNDS,
    **PROGRAM,
}


PathToFollow = Annotated[
    Path | None,
    typer.Option(
        "--path", help="toolpath that the program should follow; a job .toml also gives tool and bounds"
    ),
]


@takes(CHECKING)
def verify(
    context: typer.Context,
    program: Annotated[
        Path | None, typer.Argument(help="NC program in any supported language, CL file or motion.csv")
    ] = None,
    path: PathToFollow = None,
    control: Annotated[
        str | None,
        typer.Option("--control", help="control of the program, if it isn't that of the job (--path)"),
    ] = None,
    codes: Annotated[bool, typer.Option("--codes", help="list the codes of all findings and stop")] = False,
    stock_result: Annotated[
        Path | None,
        typer.Option("--stock-result", help="write the stock that is left (.npz), for a next program"),
    ] = None,
    stock_map: Annotated[
        Path | None,
        typer.Option(
            "--stock-map", help="write a page of the finished part, coloured by what is left (.html)"
        ),
    ] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Verify a program against its machine, the part and the path that it should follow."""
    with errors_explained(as_json):
        if codes:
            return _print_codes(as_json)
        if program is None:
            raise SettingError("name a program to verify, or give --codes")
        options = context.params

        reports: dict[Operation | None, Report] = {}

        def work(step: Progress) -> tuple[Machine, tuple[Finding, ...]]:
            step("reading part and path", 0, 1)
            machine, against, told = load_checked(path, options)
            each = operations_apart(program, machine, reading_of(options), whole=path is not None)
            for number, (operation, reading) in enumerate(each):
                step("verifying the program", number, len(each))
                report = check_program(program, machine, against, reading)
                reports[operation] = report
                if report.cut is not None:
                    around = replace(against.surroundings or Surroundings(), blank=report.cut.following())
                    against = replace(against, surroundings=around)
            _save_stock(reports.values(), stock_result, stock_map)
            return machine, told

        with shown_work(err, hidden=as_json) as shown:
            from fiveaxis.check import Surroundings, check_program

            machine, told = shown.run(work)
        print_causes(group_findings(told), err)
        head = {"program": program.name, "machine": machine.name}
        apart = [
            {"operation": operation.as_dict()} | report.as_dict()
            for operation, report in reports.items()
            if operation is not None
        ]
        if as_json:
            print_json(head | ({"operations": apart} if apart else reports[None].as_dict()))
        for operation, report in reports.items() if not as_json else ():
            if operation is not None:
                out.print(f"operation {operation.number}: {operation}", style="bold", highlight=False)
            _print_report(report)
        if not all(report.ok for report in reports.values()):
            raise typer.Exit(1)


def _save_stock(reports: Iterable[Report], result: Path | None, picture: Path | None) -> None:
    from fiveaxis.check import save_stock
    from fiveaxis.show import write_finished

    if result is None and picture is None:
        return
    *_, cut = [None, *(report.cut for report in reports if report.cut is not None)]
    if cut is None:
        raise SettingError("no stock was cut; give tool, closed part and stock (--tool, --part, --stock)")
    if result is not None:
        save_stock(cut.finished, result)
    if picture is not None:
        write_finished(cut, picture, "The finished part")


def operations_apart(
    program: Path, machine: Machine, reading: Reading, *, whole: bool = False
) -> list[tuple[Operation | None, Reading]]:
    """List the operations of a program that holds several, all or the chosen ones, with how to read each.

    What can't be read is told and left out, unless it is chosen.

    Parameters
    ----------
    whole : whether the program is to be one: a path that it follows is that of one operation
    """
    from fiveaxis.nc import load_source, operation_readings

    # Whoever reads a file says that it is missing.
    if whole or program.suffix.lower() == ".csv" or not program.is_file():
        return [(None, reading)]
    each = operation_readings(load_source(program), machine, reading)
    chosen, read = reading.operation is not None, []
    for operation, own in each:
        if operation is not None and operation.kind == "unread" and not chosen:
            err.print(f"operation {operation.number} is left out: {operation}", markup=False, soft_wrap=True)
        else:
            read.append((operation, own))
    return read


def load_checked(
    path: Path | None, options: Mapping[str, Any]
) -> tuple[Machine, Against, tuple[Finding, ...]]:
    """Load a check's machine and what it checks against, and say where a job's part stands."""
    from fiveaxis.cam import on_part
    from fiveaxis.check import DEFAULT_TOLERANCES, Against, Checking
    from fiveaxis.job import part_unit, read_job, resolve, stated_control
    from fiveaxis.model import Constraints, load_machine, parse_tool
    from fiveaxis.nc import ProgramOptions, read_toolpath

    tool = None if options["tool"] is None else parse_tool(options["tool"])
    around, toolpath, required = _surroundings(options), None, None
    given = read_flags(ProgramBounds, options)
    bounds = Checking(**given).bounds
    gouge = options["gouge_tolerance"]
    named = "crease", "part_unit", "surface_tolerance"
    meshes = {name: options[name] for name in named if options[name] is not None}
    findings: tuple[Finding, ...] = ()
    if path is not None and path.suffix.lower() == ".toml":
        task = resolve(_moved(read_job(path), options))
        job, machine, toolpath = task.job, task.machine, task.toolpath
        findings = tuple(finding for finding in toolpath.findings if finding.code == "part-placed")
        around = task.around if around is None else around
        if options["above_table"] is None:
            around = replace(around, above_table=job.surrounding.above_table)
        bounds = replace(job.bounds, **given)
        gouge = gouge or job.surrounding.gouge_tolerance
        meshes = {"crease": job.meshes.crease, "part_unit": part_unit(job) or "mm"} | meshes
        required = ProgramOptions(control=options["control"] or stated_control(job), settings=job.nc)
    else:
        given_to = read_flags(OnMachine, options)
        machine = load_machine(require_machine(options["machine"]), given_to.get("assume"))
        machine = set_up(machine, options)
        if path is not None:
            shape = options["path_shape"]
            toolpath = read_toolpath(path, tool=tool, machine=machine, path_shape=shape)
    machine = machine.with_control(options["control"])
    allowed = DEFAULT_TOLERANCES if gouge is None else DEFAULT_TOLERANCES.with_gouge(gouge)
    cutter = tool or (None if toolpath is None else toolpath.tool)
    if toolpath is not None and around is not None:
        toolpath = on_part(toolpath, around.part)
    against = Against(
        toolpath,
        cutter,
        around,
        Constraints.of(bounds),
        allowed,
        program=required,
        **meshes,
    )
    return machine, against, findings


def set_up(machine: Machine, options: Mapping[str, Any]) -> Machine:
    """Give a machine the tool length and the setup of the options, where there are any."""
    if options["tool_length"] is not None:
        machine = machine.with_tool_length(options["tool_length"])
    given = read_flags(Placing, options)
    there = Placing(**given)
    return machine.with_setup(there.offset, there.rotation) if given else machine


def _moved(job: Job, options: Mapping[str, Any]) -> Job:
    shape = options["path_shape"]
    changed = read_flags(OnMachine, options) | ({} if shape is None else {"path_shape": shape})
    setup = job.setup.model_copy(update=read_flags(Placing, options))
    return job.model_copy(update=changed | {"setup": setup})


def reading_of(options: Mapping[str, Any]) -> Reading:
    """Collect the options for reading the program."""
    unit = {} if options["unit"] is None else {"unit": options["unit"]}
    return Reading(**unit | read_flags(ReadProgram, options))


def _surroundings(options: Mapping[str, Any]) -> Surroundings | None:
    """Load part, stock, fixtures and their height over the table; None where none is given."""
    from fiveaxis.check import Surroundings
    from fiveaxis.job import read_fixtures

    near = Workpiece(**read_flags(Workpiece, options))
    if near.part is None and near.stock is None and options["fixtures"] is None:
        return None if near.above_table is None else Surroundings(above_table=near.above_table)
    found = {} if options["fixtures"] is None else read_fixtures(options["fixtures"])
    fixtures = tuple(table.build() for table in found.get("fixture") or ())
    clearance = found.get("clearance")
    clearances = None if clearance is None else clearance.build()
    return Surroundings.of(near, CadFile(**read_flags(CadFile, options)), fixtures, clearances)


def _print_report(report: Report) -> None:
    causes = report.summary()
    print_causes(causes, out)
    if len(report.findings) > len(causes):
        err.print("--json lists the worst findings of each code")
    lists = {
        "passed": report.passed,
        "not asked for": [gap.sentence for gap in report.not_asked],
        "risk": group_gaps(report.risks),
    }
    for name, sentences in lists.items():
        if name == "risk" or is_verbose():
            for sentence in sentences:
                print_filled(f"{name}: {sentence}")
        elif sentences:
            out.print(f"{name}: {len(sentences)} (-v lists them)", highlight=False)
    verdict = "no errors" if report.ok else "[bold red]errors[/]"
    out.print(
        f"verification: {verdict}{', but not every risk was checked' * bool(report.ok and report.risks)}"
    )


def _print_codes(as_json: bool) -> None:
    from fiveaxis.base import CODES, OVERRIDABLE

    if as_json:
        rows = {
            name: {"severity": c.severity, "meaning": c.meaning, "override": name in OVERRIDABLE}
            for name, c in CODES.items()
        }
        return print_json(rows)
    print_table(("code", "at worst", "meaning"), ((name, c.severity, c.meaning) for name, c in CODES.items()))
