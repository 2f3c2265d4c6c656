"""Where the part stands when nobody says: on the table's centre, or where its path can be reached."""

from __future__ import annotations

from dataclasses import replace

from fiveaxis.base import USUAL_CONE, Finding, Infeasible, Place, Severity
from fiveaxis.check import Surroundings
from fiveaxis.job.description import Job
from fiveaxis.job.reach import Reach
from fiveaxis.model import (
    Body,
    Box,
    Constraints,
    Cylinder,
    Machine,
    Toolpath,
    Triple,
    load_machine,
    require_orienting,
)
from fiveaxis.nc import load_source, set_up_as_stated

# Automatic ranges for the setup: mm to each side, deg.
WIDEST, ROUND = 100.0, (-180.0, 180.0)
# deg: how far from its own postures a program may be reached that is revised in its lines.
AS_IT_IS = 1.0


def with_usual_cone(job: Job, toolpath: Toolpath) -> tuple[Job, Toolpath]:
    """Let the tool lean by `USUAL_CONE` from the programmed axes where nothing bounds it, and say so."""
    if job.constraints.bounds_angle or not toolpath.has_axes:
        return job, toolpath
    message = (
        f"nothing bounds the tool's lean, so it stays within {USUAL_CONE:g} deg of the programmed axis; "
        "choose that angle (--cone 20), or bound the angle to the surface (--tilt, --lead, --lean)"
    )
    said = Finding(Severity.NOTE, "cone-assumed", message, Place(file=toolpath.name))
    toolpath = replace(toolpath, findings=(*toolpath.findings, said))
    return job.model_copy(update={"cone": USUAL_CONE}), toolpath


def place(
    job: Job, machine: Machine, toolpath: Toolpath, around: Surroundings | None, *, in_place: bool
) -> tuple[Job, tuple[Finding, ...]]:
    """Choose where the part stands if a job gives no work offset.

    Parameters
    ----------
    machine : in the job's setup
    around : what the tool keeps clear of; None where it needn't
    in_place : whether its program is revised in its lines

    Returns
    -------
    The job with its offset, and what has been chosen; no finding where the offset is given, or where
    `choose_offset` leaves it at 0. A program under TCP stays where its head says that the workpiece stands.
    """
    search = job.setup.search
    said = "offset" in job.setup.model_fields_set or (search is not None and not search.auto)
    model = None if said or job.program.machine is not None else job.machine
    if model is not None and toolpath.operation is not None and toolpath.operation.tcp:
        there, told = set_up_as_stated(load_machine(model, job.assume), load_source(job.input))
        if there.setup.stated:
            stated = {"offset": there.setup.offset, "rotation": there.setup.rotation_deg}
            return job.model_copy(update={"setup": job.setup.model_copy(update=stated)}), told
    bounds = job.constraints
    if in_place and not said:
        if job.reading.zero or (toolpath.operation is not None and not toolpath.operation.tcp):
            return job, ()  # where the path lies on the part hangs on where the part stands
        bounds = as_it_runs(toolpath, machine, around) or bounds
    chosen = None if said else choose_offset(toolpath, machine, bounds, around)
    if chosen is None:
        return job, ()
    offset, finding = chosen
    setup = job.setup.model_copy(update={"offset": offset})
    return job.model_copy(update={"setup": setup}), (finding,)


def as_it_runs(toolpath: Toolpath, machine: Machine, around: Surroundings | None) -> Constraints | None:
    """Return bounds that keep a program's own postures; None if the machine can't take them anywhere."""
    own = Constraints.of_degrees(cone=AS_IT_IS)
    reach = Reach.of(toolpath, machine, own, machine.setup.rotation_deg, around)
    return own if reach.reached_wherever().all() else None


def with_ranges(job: Job, machine: Machine) -> Job:
    """Give a job's automatic search for the setup its ranges, about the place that is given or was chosen.

    X and Y go a quarter of the shortest linear travel to both sides, at most `WIDEST`; Z goes as far, but
    only up: the table is below. The part turns all around.
    """
    search = job.setup.search
    if search is None or not search.auto:
        return job
    travels = (machine.high - machine.low)[machine.linear_columns]
    side = min(WIDEST, 0.25 * float(travels.min()))
    x, y, z = job.setup.offset
    ends = {"x": (x - side, x + side), "y": (y - side, y + side), "z": (z, z + side), "angle": ROUND}
    ranged = search.model_copy(update={"auto": False} | ends | search.ranges)
    return job.model_copy(update={"setup": job.setup.model_copy(update={"search": ranged})})


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
    message = f"part placed at {_words(offset)}: {why}; --work-offset says otherwise"
    return offset, Finding(Severity.WARNING, "part-placed", message)


def advised(
    fault: Infeasible, job: Job, machine: Machine, toolpath: Toolpath, around: Surroundings | None
) -> Infeasible:
    """Add to a fault where the part could stand so that every location is reached; unchanged if nowhere."""
    if job.constraints.hold or not any(finding.code == "no-posture" for finding in fault.findings):
        return fault
    reach = Reach.of(toolpath, machine, job.constraints, job.setup.rotation, around)
    if (reach.reached(job.setup.offset) | ~reach.reached_wherever()).all():
        return fault
    nearest = reach.nearest(job.setup.offset)
    reached = int(reach.reached(nearest).sum())
    share = "all of them are" if reached == len(reach) else f"{reached} of {len(reach)} tried ones are"
    text = f"with the part at {_words(nearest)} {share} reached (--work-offset {_numbers(nearest)})"
    return Infeasible(f"{fault}; {text}", fault.findings)


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


def _words(offset: Triple) -> str:
    return " ".join(f"{letter}{value:g}" for letter, value in zip("XYZ", offset, strict=True))


def _numbers(offset: Triple) -> str:
    return ",".join(f"{value:g}" for value in offset)
