"""The commands about machines, and the faces of a CAD file, as `fiveaxis info` shows them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from fiveaxis.base import (
    CAD_SUFFIXES,
    Reading,
    SettingError,
    Severity,
    Unit,
    group_findings,
    options_of,
    require_file,
    require_suffix,
)
from fiveaxis.cli.options import AsJson, takes
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import (
    err,
    errors_explained,
    out,
    print_causes,
    print_json,
    print_table,
    print_written,
)
from fiveaxis.cli.verify_verb import PROGRAM, reading_of
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.cam import FaceSheet
    from fiveaxis.model import FormShapingCode
    from fiveaxis.show import OperationLook


MachineFileName = Annotated[
    str,
    typer.Argument(help="name (`fiveaxis machines`) or file: .toml, .ini, .urdf, .mch", metavar="MACHINE"),
]


AXIS_HEADS = (
    *("axis", "side", "direction", "through, mm"),
    *("limits", "speed, 1/s", "power + / -", "control counts"),
)
MACHINE_SUFFIXES = (".toml", ".ini", ".urdf", ".mch")

# Slow places of an operation that are printed.
MOST_SLOW = 5
NO_MACHINE = """\
No machine is given: where cuts by axis words are while rotary axes turn (?), limits, axis speeds, energy,
collisions and new postures need it (--machine; `fiveaxis machines`)."""


@takes()
def machines(as_json: AsJson = False) -> None:
    """List the machines of the library."""
    from fiveaxis.model import load_machine, machine_names

    with errors_explained(as_json):
        loaded = [load_machine(name) for name in machine_names()]
        if as_json:
            return print_json([{"name": m.name, "code": str(m.code), "axes": m.letters} for m in loaded])
        powers = ("own" if m.has_powers else "estimated" for m in loaded)
        rows = (
            (m.name, str(m.code), m.code.kind, p, escape(m.description))
            for m, p in zip(loaded, powers, strict=True)
        )
        print_table(("machine", "code", "kind", "powers", "description"), rows)


@takes()
def import_machine(
    source: Annotated[
        Path,
        typer.Argument(help="LinuxCNC .ini, URDF or Vericut .mch file", metavar="FILE", show_default=False),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="machine file (.toml); default: stdout")
    ] = None,
) -> None:
    """Convert another program's description of a machine to a machine file, to be completed by hand."""
    with errors_explained(False):
        from fiveaxis.model import machine_text, read_foreign, save_machine

        if output is not None:
            require_suffix(output, [".toml"], "a machine file")
        machine = read_foreign(source)
        if output is None:
            write_results(machine_text(machine))
        else:
            print_written(save_machine(machine, output))


@takes(PROGRAM)
def info(
    context: typer.Context,
    machine: Annotated[
        str | None,
        typer.Argument(
            help="machine, by name or file (.toml, .ini, .urdf, .mch); a program or CL file; or a CAD file",
            metavar="MACHINE|PROGRAM|PART",
            show_default=False,
        ),
    ] = None,
    code: Annotated[
        str | None, typer.Option("--code", help="form-shaping code, in place of a machine")
    ] = None,
    written_for: Annotated[
        str | None, typer.Option("--machine", "-m", help="machine of a program, for its rotary words")
    ] = None,
    tool: Annotated[
        str | None, typer.Option("--tool", help="ball that is held against the hollows of a part's faces")
    ] = None,
    body: Annotated[str | None, typer.Option("--body", help="of a CAD file, by name or number")] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Show a machine (chain, limits, powers, figures' sources), a program's operations, or a part's faces."""
    with errors_explained(as_json):
        reading = reading_of(context.params)
        if machine is not None and code is None and Path(machine).suffix.lower() in CAD_SUFFIXES:
            return print_faces(Path(machine), tool, reading.unit, body, as_json=as_json)
        if machine is not None and code is None and _is_program(Path(machine)):
            return _print_operations(Path(machine), written_for, reading, as_json=as_json)
        if reading != Reading() or written_for is not None:
            what = ", ".join(name for name in options_of(Reading) if getattr(reading, name)) or "--machine"
            raise SettingError(f"{what} is for programs, and none is named; leave it out")
        if tool is not None or body is not None:
            raise SettingError("--tool and --body are for CAD files, and none is named; leave them out")
        if (machine is None) == (code is None):
            raise SettingError("give either a machine (`fiveaxis machines` lists the names) or --code")
        if machine is not None:
            _require_readable(Path(machine))
        with shown_work(err, hidden=as_json):
            from fiveaxis.model import Machine, load_machine
            from fiveaxis.show import describe_machine

            found = Machine.from_code(code) if code is not None else load_machine(str(machine))
            sheet = describe_machine(found)
        print_json(sheet) if as_json else _print_sheet(sheet, found.code)


def _is_program(path: Path) -> bool:
    """Check whether a file is a program or CL file: no machine has its suffix or content."""
    from fiveaxis.nc import holds_path

    return path.suffix.lower() not in (*MACHINE_SUFFIXES, ".xml") and holds_path(path)


def _require_readable(path: Path) -> None:
    """Raise `SettingError` for a file that is missing, or neither a machine nor what else is shown."""
    if path.suffix and path.suffix.lower() not in MACHINE_SUFFIXES:
        require_file(path, SettingError)
        raise SettingError(
            f"is no program, CAD file ({', '.join(CAD_SUFFIXES)}) or machine ({', '.join(MACHINE_SUFFIXES)})",
            file=path,
        )


def _print_operations(path: Path, machine: str | None, reading: Reading, *, as_json: bool) -> None:
    from fiveaxis.nc import ProgramReading, measure_operations
    from fiveaxis.show import look

    with shown_work(err, hidden=as_json) as work:
        if machine is None:
            facts, seen = measure_operations(path, ProgramReading.of(reading)), None
        else:
            how = {name: getattr(reading, name) for name in options_of(Reading)}
            seen = work.run(lambda progress: look(path, machine, progress=progress, **how))
            facts = tuple(each.facts for each in seen.operations)
    found = [finding for each in facts for finding in each.findings]
    causes = group_findings(dict.fromkeys(found)) if seen is None else seen.summary
    print_causes([cause for cause in causes if cause.severity != Severity.NOTE], err)
    if as_json:
        listed = {"program": str(path), "operations": [each.as_dict() for each in facts]}
        return print_json(listed if seen is None else seen.as_dict())
    if not facts:
        return out.print("a list of points: it has no operations")
    first = facts[0].operation
    control = f", control {first.control}" if first.control else ", its words don't tell the control"
    out.print(f"{path.name}: {first.language}{control}, {first.unit}", markup=False, highlight=False)
    heads = ["", "lines", "kind", "tool", "S", "coolant", "zero", "rows", "cut mm", "cut s", "tip mm/min"]
    heads += [] if seen is None else ["s", "J", "starts", "reversals", "lost s"]
    rows = []
    for number, each in enumerate(facts):
        at = each.operation
        kind = at.kind + (", TCP" if at.tcp else "") + (", plane" if at.plane is not None else "")
        tool = " ".join(word for word in (at.tool, each.cutter) if word)
        spindle = "" if at.spindle is None else f"{at.spindle:.0f}"
        lines = f"{at.first_line}-{at.last_line}"
        length = "?" if each.cut_length is None else f"{each.cut_length:.0f}"
        feeds = " to ".join(dict.fromkeys(f"{feed:.0f}" for feed in each.feeds)) if each.feeds else "?"
        cells = [str(at.number), lines, kind, tool, spindle, at.coolant, at.work_offset, str(each.locations)]
        cells += [length, f"{each.cut_time:.1f}", feeds]
        if seen is not None:
            cells += _costs(seen.operations[number])
        rows.append(cells)
    print_table(heads, rows)
    for each in facts:
        if each.operation.why:
            what = f"{each.operation.number} can't be read: {each.operation.why}"
            out.print(what, markup=False, highlight=False, soft_wrap=True)
    if seen is None:
        if first.language != "APT":
            out.print(NO_MACHINE, markup=False, highlight=False)
        return None
    for operation in seen.operations:
        _print_slow(operation)
    for assumed in seen.assumed:
        out.print(f"assumed: {assumed}", markup=False, soft_wrap=True)
    return None


def _costs(seen: OperationLook) -> list[str]:
    spent = seen.energy
    if spent is None:
        return ["?"] * 5
    counts = (f"{spent.time:.1f}", f"{spent.total:.0f}", str(spent.starts), str(spent.reversals))
    return [*counts, f"{seen.lost:.1f}"]


def _print_slow(seen: OperationLook) -> None:
    number = seen.facts.operation.number
    if seen.fault:
        out.print(f"{number} has no price: {seen.fault}", markup=False, soft_wrap=True)
    for place in seen.slow[:MOST_SLOW]:
        feeds = "" if place.asked is None else f", {place.got:.0f} of {place.asked:.0f} mm/min"
        lines = str(place.first) if place.first == place.last else f"{place.first}-{place.last}"
        what = f"{number} is slow at {lines}: {place.lost:.1f} s lost to {place.cause or 'its limits'}{feeds}"
        out.print(what, markup=False, highlight=False, soft_wrap=True)
    if (more := len(seen.slow) - MOST_SLOW) > 0:
        out.print(f"{number} is slow at {more} more places; --json lists them", highlight=False)


@takes()
def check(machine: MachineFileName, as_json: AsJson = False) -> None:
    """Check a machine file for faults, wrong units and missing figures."""
    with errors_explained(as_json):
        from fiveaxis.base import count_codes, has_errors
        from fiveaxis.model import check_machine, load_machine
        from fiveaxis.nc import control_for

        findings = check_machine(machine)
        if not has_errors(findings):
            control_for(load_machine(machine))
        if as_json:
            print_json({"findings": [f.as_dict() for f in findings], "counts": count_codes(findings)})
        else:
            for finding in findings:
                out.print(f"{finding.severity}: {finding}", markup=False, soft_wrap=True)
            shares = (f"{sum(f.severity is s for f in findings)} {s}s" for s in Severity)
            out.print(", ".join(shares), markup=False)
        if has_errors(findings):
            raise typer.Exit(1)


@takes()
def urdf(
    machine: MachineFileName,
    root: Annotated[
        str, typer.Option("--root", help="root link: workpiece (one branch to the tool) or bed (a tree)")
    ] = "workpiece",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="URDF file; default: stdout")] = None,
) -> None:
    """Write a machine as URDF, for pinocchio, ROS and other programs."""
    with errors_explained(False):
        from fiveaxis.base import write_atomically
        from fiveaxis.model import load_machine, stand_ins

        if output is not None:
            require_suffix(output, [".urdf"], "a URDF file")
        described = load_machine(machine)
        text = described.to_urdf(root)
        if output is None:
            write_results(text)
        else:
            print_written(write_atomically(output, text))
        err.print(stand_ins(described), markup=False)


def _print_sheet(sheet: dict[str, Any], code: FormShapingCode) -> None:
    out.print(f"[bold]{escape(sheet['name'])}[/]  {escape(sheet['description'])}")
    chain = " - ".join(["workpiece", *code.table, "bed", *code.head, "tool"])
    out.print(f"code {code}: {chain}; {sheet['kind']}, kinematics of class {sheet['kinematic_class']}")
    if sheet["control"] is not None:
        out.print(f"control {escape(sheet['control'])}")
    if sheet["positioning"] != "every position":
        out.print(escape(f"not every position: {sheet['positioning']}"))
    for line in _orientation_lines(sheet["orientation"]):
        out.print(escape(line))
    print_table(AXIS_HEADS, _axis_rows(sheet))
    if sheet["base_power"] is not None:
        out.print(f"base power {sheet['base_power']:g} W")
    if sheet["figures"]:
        origins = (("assumed: " if f["assumed"] else "") + f["source"] for f in sheet["figures"])
        rows = zip(sheet["figures"], map(escape, origins), strict=True)
        print_table(("figure", "value", "source"), ((f["figure"], escape(f["value"]), o) for f, o in rows))
    if sheet["to_measure"] is not None:
        _print_missing(sheet["to_measure"])


def _print_missing(missing: dict[str, Any]) -> None:
    """Show which dimensions place the rotary axes, and where they are measured."""
    out.print(f"not every pivot is known: measure from {missing['zero']}, every axis at 0", markup=False)
    for line in missing["drawing"]:
        out.print(f"  {line}", markup=False)
    for dimension in missing["dimensions"]:
        out.print(f"  {dimension['name']}: {dimension['text']} ({dimension['key']})", markup=False)


def _orientation_lines(orientation: dict[str, Any]) -> Iterator[str]:
    if not orientation["branches"]:
        yield f"no choice of posture: {orientation['reason']}"
        return
    singular, direction = orientation["singular_axis"], _vector(orientation["singular_direction"])
    letter, middle = orientation["branch_axis"], orientation["branch_middle"]
    yield f"singular direction {direction}: with the tool along it every angle of {singular} is possible"
    yield f"branches: 2; each inclination from there is reached with {letter} = {middle:g} deg ± one angle"
    both = " and ".join(map(_range, orientation["both_branches_within_limits"])) or "nowhere"
    yield (
        f"inclination {_range(orientation['lean_reach'])}, within limits "
        f"{_range(orientation['lean_within_limits'])}, with both branches {both}"
    )


def _axis_rows(sheet: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for joint in sheet["chain"]:
        letter = joint["axis"]
        unit = "deg" if letter in "ABC" else "mm"
        at = joint.get("point", ())
        point = "unknown" if at is None else _vector(at) if at else ""
        speed = "unknown" if sheet["speeds"][letter] is None else f"{sheet['speeds'][letter]:g} {unit}/s"
        powers = _power(sheet["powers"][letter])
        counted = "reversed" if letter in sheet["reversed"] else ""
        counted = "unknown" if f"{letter}.counts" in sheet["unknown"] else counted
        direction = _vector(joint["direction"])
        low, high = sheet["limits"][letter]
        open_ended = "endless" if letter in "ABC" else "unknown"
        limits = open_ended if low is high is None else f"{_end(low)} … {_end(high)} {unit}"
        yield letter, joint["side"], direction, point, limits, speed, powers, counted


def _power(power: dict[str, Any] | None) -> str:
    if power is None:
        return "unknown"
    if power["model"] == "directional":
        return f"{power['plus']:g} / {power['minus']:g} {power['unit']}"
    return f"{power['model']} model"


def _vector(numbers: list[float]) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in numbers) + ")"


def _range(ends: list[float]) -> str:
    return f"{ends[0]:.4g} … {ends[1]:.4g} deg"


def _end(value: float | None) -> str:
    return "endless" if value is None else f"{value:g}"


def print_faces(path: Path, tool: str | None, unit: Unit | None, body: str | None, *, as_json: bool) -> None:
    """Print the faces of a CAD file, and whether a ball is small enough for their hollows."""
    from fiveaxis.cam import load_mesh, size_text, survey
    from fiveaxis.model import parse_tool

    radius = None if tool is None else parse_tool(tool).radius
    with shown_work(err, hidden=as_json):
        mesh = load_mesh(path, unit=unit, body=body, allow_open=True)
        model = mesh.model
        sheets = () if model is None else survey(model)
    size, bodies = mesh.extents, {} if model is None else model.bodies
    if as_json:
        return print_json(
            {
                "part": str(path),
                "size_mm": [round(float(extent), 6) for extent in size],
                "closed": mesh.is_watertight,
                "mesh_deviation_mm": None if model is None else round(model.deviation, 6),
                "bodies": [{"number": number, "name": name} for number, name in bodies.items()],
                "faces": [
                    sheet.as_dict() | ({} if radius is None else {"ball_fits": sheet.takes(radius)})
                    for sheet in sheets
                ],
            }
        )
    out.print(f"part {size_text(size)}, {'closed' if mesh.is_watertight else 'open'}", highlight=False)
    for number, name in bodies.items():
        out.print(f"body {number}: {name}", markup=False, highlight=False)
    heads = ["face", "body", "kind", "area mm²", "normal", "spread °", "overhang %", "hollow mm"]
    print_table([*heads, *["ball"] * (radius is not None), "colour", "layer"], _face_rows(sheets, radius))


def _face_rows(sheets: Sequence[FaceSheet], radius: float | None) -> Iterator[list[str]]:
    for sheet in sheets:
        face = sheet.face
        row = [str(face.number), str(face.body), face.kind, f"{face.area:.2f}"]
        row += [" ".join(f"{round(value, 2) + 0.0:.2f}" for value in sheet.normal), f"{sheet.spread:.1f}"]
        row += [f"{100.0 * sheet.overhang:.0f}"]
        row += [f"{sheet.hollow:.2f}" if math.isfinite(sheet.hollow) else ""]
        if radius is not None:
            row += ["fits" if sheet.takes(radius) else "too large"]
        yield [*row, face.colour, escape(face.layer)]
