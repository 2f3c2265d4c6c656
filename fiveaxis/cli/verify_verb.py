"""The verb that checks programs, wherever they come from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from fiveaxis.cli.options import (
    BlockDelete,
    Cone,
    Fixtures,
    GougeTolerance,
    Hold,
    Lead,
    Lean,
    MachineName,
    MaxTurn,
    PartRotation,
    ProgramZero,
    Rapid,
    SingularCone,
    SingularRate,
    Start,
    Stock,
    SurfaceTolerance,
    Tilt,
    ToolLength,
    ToolName,
    ToolPlane,
    Unit,
    WorkOffset,
    Wrap,
    takes,
)
from fiveaxis.cli.terminal import (
    err,
    errors_explained,
    out,
    parse_numbers,
    parse_places,
    print_causes,
    print_json,
    required,
)
from fiveaxis.cli.work import work_aside
from fiveaxis.errors import SettingError

if TYPE_CHECKING:
    from fiveaxis.collision import Surroundings
    from fiveaxis.machine import Machine
    from fiveaxis.verification import Report

CHECKING: Mapping[str, Any] = {
    "machine": MachineName,
    "tool": ToolName,
    "tilt": Tilt,
    "cone": Cone,
    "lead": Lead,
    "lean": Lean,
    "plane": ToolPlane,
    "hold": Hold,
    "max_turn": MaxTurn,
    "singular_cone": SingularCone,
    "singular_rate": SingularRate,
    "stock": Stock,
    "fixtures": Fixtures,
    "surface_tolerance": SurfaceTolerance,
    "gouge_tolerance": GougeTolerance,
    "unit": Unit,
    "program_zero": ProgramZero,
    "start": Start,
    "rapid": Rapid,
    "block_delete": BlockDelete,
    "wrap": Wrap,
    "tool_length": ToolLength,
    "work_offset": WorkOffset,
    "part_rotation": PartRotation,
}
# Options that the library call takes under the same name and as they are.
PLAIN = (
    *("cone", "max_turn", "singular_cone", "singular_rate"),
    *("surface_tolerance", "gouge_tolerance", "unit"),
)


@takes(CHECKING)
def verify(
    context: typer.Context,
    program: Annotated[
        Path | None, typer.Argument(help="NC program of any language read here, or motion.csv")
    ] = None,
    part: Annotated[
        Path | None, typer.Option("--part", help="mesh of the finished part: gouges are looked for")
    ] = None,
    path: Annotated[
        Path | None, typer.Option("--path", help="toolpath (or job .toml) that the program should follow")
    ] = None,
    codes: Annotated[bool, typer.Option("--codes", help="print every code of a finding and stop")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON document and nothing else")] = False,
    **_: Any,
) -> None:
    """Check a program against its machine, the part and the path that it should follow."""
    with errors_explained(as_json):
        if codes:
            return _print_codes(as_json)
        from fiveaxis.job import verify_program

        if program is None:
            raise SettingError("name a program to verify, or give --codes")
        options = context.params
        machine = _machine(options)
        report = work_aside(
            lambda: verify_program(
                program,
                machine,
                surroundings=_surroundings(part, options),
                **path_and_tool(path, options, machine),
                **_settings(options),
            )
        )
        if as_json:
            print_json({"program": program.name, "machine": machine.name} | report.as_dict())
        else:
            _print_report(report)
        if not report.ok:
            raise typer.Exit(1)


def _machine(options: Mapping[str, Any]) -> Machine:
    from fiveaxis.machine import load_machine

    machine = load_machine(required(options["machine"], "machine"))
    offset, rotation = (_triple(options[name] or "0,0,0") for name in ("work_offset", "part_rotation"))
    return machine.with_setup(offset, rotation).with_tool_length(options["tool_length"] or 0.0)


def _surroundings(part: Path | None, options: Mapping[str, Any]) -> Surroundings | None:
    """Load what stands around the tool; None where nothing is given."""
    from fiveaxis.collision import Surroundings
    from fiveaxis.job import read_fixtures

    if part is None and options["stock"] is None and options["fixtures"] is None:
        return None
    found = {} if options["fixtures"] is None else read_fixtures(options["fixtures"])
    fixtures = tuple(table.build(Path()) for table in found.get("fixture") or ())
    clearance = found.get("clearance")
    return Surroundings.load(
        part, options["stock"], fixtures, None if clearance is None else clearance.build()
    )


def _triple(text: str) -> tuple[float, float, float]:
    x, y, z = parse_numbers(text, 3, "X,Y,Z")
    return x, y, z


def path_and_tool(path: Path | None, options: Mapping[str, Any], machine: Machine) -> dict[str, Any]:
    """Load the tool, and the path that the program is compared with."""
    from fiveaxis.job import load_job_toolpath, read_job
    from fiveaxis.nc import read_toolpath
    from fiveaxis.toolpath import parse_tool

    tool = None if options["tool"] is None else parse_tool(options["tool"])
    if path is None:
        return {"tool": tool}
    if path.suffix.lower() == ".toml":
        return {"tool": tool, "toolpath": load_job_toolpath(read_job(path))}
    return {"tool": tool, "toolpath": read_toolpath(path, tool=tool, machine=machine)}


def _settings(options: Mapping[str, Any]) -> dict[str, Any]:
    """Turn options into those of the library call; what nobody gave is left to its defaults."""
    given: dict[str, Any] = {name: options[name] for name in PLAIN}
    for name in ("tilt", "lead", "lean"):
        text = options[name]
        given[name] = None if text is None else tuple(parse_numbers(text, 2, "MIN:MAX", ":"))
    plane = options["plane"]
    given["plane"] = None if plane is None else _triple(plane)
    for name in ("hold", "start", "program_zero"):
        given[name] = parse_places(f"--{name.replace('_', '-')}", options[name])
    given["rapid_mm_min"] = options["rapid"]
    given["block_delete"] = options["block_delete"] or None
    given["wrap"] = options["wrap"]
    return {name: value for name, value in given.items() if value is not None}


def _print_report(report: Report) -> None:
    causes = report.summary()
    print_causes(causes, out)
    if len(report.findings) > len(causes):
        err.print("--json lists the worst findings of each code")
    for sentence in report.checked:
        out.print(f"checked: {escape(sentence)}", soft_wrap=True)
    for sentence in report.not_checked:
        out.print(f"not checked: {escape(sentence)}", soft_wrap=True)
    out.print("verification: " + ("no errors" if report.ok else "[bold red]errors[/]"))


def _print_codes(as_json: bool) -> None:
    from fiveaxis.codes import CODES, OVERRIDABLE

    if as_json:
        rows = {
            name: {"severity": c.severity, "meaning": c.meaning, "override": name in OVERRIDABLE}
            for name, c in CODES.items()
        }
        return print_json(rows)
    table = Table("code", "at worst", "meaning", box=None)
    for name, code in CODES.items():
        table.add_row(name, code.severity, code.meaning)
    out.print(table)
