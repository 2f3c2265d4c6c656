"""Where the part stands when nobody says: on the table's centre, or where its path can be reached."""

from __future__ import annotations

from dataclasses import replace

from fiveaxis.base import USUAL_CONE, Finding, Infeasible, Place, Severity
from fiveaxis.check import Reach, Surroundings, as_it_runs, choose_offset, in_words
from fiveaxis.job.description import Job
from fiveaxis.model import Machine, Toolpath, load_machine
from fiveaxis.nc import load_source, set_up_as_stated

# Automatic ranges for the setup: mm to each side, deg.
WIDEST, ROUND = 100.0, (-180.0, 180.0)


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
    numbers = ",".join(f"{value:g}" for value in nearest)
    text = f"with the part at {in_words(nearest)} {share} reached (--work-offset {numbers})"
    return Infeasible(f"{fault}; {text}", fault.findings)
