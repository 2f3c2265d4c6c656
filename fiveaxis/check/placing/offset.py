"""Where the part stands when nobody says: on the table's centre, or where its path can be reached."""

from __future__ import annotations

from dataclasses import replace

from fiveaxis.base import USUAL_CONE, Finding, FiveAxisError, Reading, Severity
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.check.placing.reach import Reach
from fiveaxis.model import (
    Body,
    Box,
    Constraints,
    Cylinder,
    Machine,
    Toolpath,
    Triple,
    parse_tool,
    require_orienting,
)
from fiveaxis.nc import STAND_IN, ReadOptions, Source, read_path_of, set_up_as_stated

# deg: how far from its own postures a program may be reached that is revised in its lines.
AS_IT_IS = 1.0


def choose_offset(
    toolpath: Toolpath, machine: Machine, constraints: Constraints, around: Surroundings | None
) -> tuple[Triple, Finding] | None:
    """Choose a work offset where none was given.

    The part stands on the table's centre (`table_centre`) if the path is reached there; else at the nearest
    place on the table or above it, rounded to mm, at which as much of it is reached as can be found. Reached
    is what a posture within the limits keeps clear of the table, part and fixtures.

    Parameters
    ----------
    around : part and fixtures; None to keep clear of nothing

    Returns
    -------
    The offset, mm, machine frame, and what is to be said of it; None where it is 0, or where the constraints
    don't bound the tool axis

    Raises
    ------
    MachineError
        The machine's rotary axes can't lean the tool in two directions.
    """
    require_orienting(machine)
    if constraints.hold or not constraints.bounds_angle:
        return None
    reach = Reach.of(toolpath, machine, constraints, machine.setup.rotation_deg, around)
    centre = table_centre(machine)
    offset, why = centre, "no work offset was given"
    missed = int((reach.reached_wherever() & ~reach.reached(centre)).sum())
    if missed:
        offset = reach.nearest(centre)
        why += f", and on the table's centre {missed} of {len(reach)} tried locations can't be reached"
    if offset == (0.0, 0.0, 0.0):
        return None
    message = f"part placed at {in_words(offset)}: {why}; --work-offset says otherwise"
    return offset, Finding(Severity.WARNING, "part-placed", message)


def placed(
    toolpath: Toolpath, machine: Machine, constraints: Constraints, around: Surroundings | None
) -> tuple[Toolpath, Machine]:
    """Place the part as a job does, unless the machine's setup was stated; the path's findings say where."""
    chosen = None if machine.setup.stated else choose_offset(toolpath, machine, constraints, around)
    if chosen is None:
        return toolpath, machine
    offset, finding = chosen
    there = machine.with_setup(offset, machine.setup.rotation_deg)
    return replace(toolpath, findings=(*toolpath.findings, finding)), there


def as_it_runs(toolpath: Toolpath, machine: Machine, around: Surroundings | None) -> Constraints | None:
    """Return bounds that keep a program's own postures; None if the machine can't take them anywhere."""
    own = Constraints.of_degrees(cone=AS_IT_IS)
    reach = Reach.of(toolpath, machine, own, machine.setup.rotation_deg, around)
    return own if reach.reached_wherever().all() else None


def placed_program(
    source: Source, machine: Machine, reading: Reading, cutter: str | None
) -> tuple[Machine, tuple[Finding, ...]]:
    """Place the part as `place` does for a program under TCP; a cutter that nobody knows is a small ball.

    Parameters
    ----------
    reading : of its first operation under TCP that turns the tool

    Returns
    -------
    The machine, and what is said of it
    """
    there, told = set_up_as_stated(machine, source)
    if there.setup.stated or reading.zero:
        return there, told
    tool = STAND_IN if cutter is None else parse_tool(cutter)
    try:
        path = read_path_of(source, ReadOptions.of(Reading.of(reading), tool=tool, machine=machine))
        bounds = as_it_runs(path, machine, None) or Constraints.of_degrees(cone=USUAL_CONE)
        chosen = choose_offset(path, machine, bounds, None)
    except FiveAxisError:  # its operation says why it can't be read
        return machine, ()
    if chosen is None:
        return machine, ()
    offset, finding = chosen
    return machine.with_setup(offset, machine.setup.rotation_deg), (finding,)


def table_centre(machine: Machine) -> Triple:
    """Return the top of the body that carries the part, mm, machine frame; 0 where there is none."""
    link = machine.code.table[0] if machine.code.table else "bed"
    tops = [top for body in machine.bodies if body.link == link and (top := _top(body)) is not None]
    return max(tops, key=lambda top: top[2], default=(0.0, 0.0, 0.0))


def _top(body: Body) -> Triple | None:
    """Return the middle of a body's upper side; None for a mesh, or a cylinder that lies."""
    shape = body.shape
    if isinstance(shape, Box):
        x, y, z = shape.center
        return x, y, z + shape.size[2] / 2.0
    if isinstance(shape, Cylinder) and abs(shape.direction[2]) > 1.0 - 1e-9:
        x, y, z = shape.center
        return x, y, z + shape.height / 2.0
    return None


def in_words(offset: Triple) -> str:
    """Write an offset, mm, as words of its axes."""
    return " ".join(f"{letter}{value:g}" for letter, value in zip("XYZ", offset, strict=True))
