"""Where the part stands when nobody says: on the table's centre, or where its path can be reached."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray, perpendicular, product
from fiveaxis.job.box_search import search_box
from fiveaxis.job.description import Job
from fiveaxis.job.kept import keep_stated
from fiveaxis.job.loading import load_job_machine, load_job_passes, revises
from fiveaxis.kinematics import (
    hold_singular,
    linear_positions,
    require_orienting,
    rotary_angles,
    within_limits,
)
from fiveaxis.kinematics.windings import into_limits
from fiveaxis.machine import Body, Box, Cylinder, Limits, Machine
from fiveaxis.machine.chain import Triple, as_triple
from fiveaxis.posture.baselines import INSIDE
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import Constraints, Toolpath
from fiveaxis.toolpath.passes import Passes

# Locations of the path, and tool axes at each of them, on which places are tried.
LOCATIONS, RINGS, AXES_PER_RING = 120, 4, 16
# Places that are tried in the whole range, and again around the best one; the second range, as a share.
TRIES, AROUND = 400, 0.1
# Distance to keep from the ends of linear axes: mm, and at most this share of their travel.
MARGIN, MARGIN_SHARE = 10.0, 0.05
# What a mm away from the table's centre counts beside a mm beyond a limit, at one location.
ASIDE = 1e-3


@dataclass(frozen=True, eq=False)
class PlacedJob:
    """A job with its part where it stands, and what it names.

    Parameters
    ----------
    job : with its work offset
    machine : with the job's setup
    toolpath : its findings tell where the part was placed, if the job doesn't say
    passes : of a planned path
    """

    job: Job
    machine: Machine
    toolpath: Toolpath
    passes: Passes | None


def load_placed(job: Job, progress: Progress = unheard) -> PlacedJob:
    """Load a job's machine and path, and place the part if the job gives no work offset.

    Raises
    ------
    FiveAxisError
        As `load_job_machine` and `load_job_toolpath`.
    """
    machine = load_job_machine(job)
    toolpath, passes = load_job_passes(job, progress)
    if not revises(job):
        job, toolpath = keep_stated(job, toolpath)
    progress("placing the part", 0, 1)
    there, findings = place(job, machine, toolpath)
    if findings:
        machine = load_job_machine(there)
        toolpath = replace(toolpath, findings=(*toolpath.findings, *findings))
    return PlacedJob(there, machine, toolpath, passes)


def place(job: Job, machine: Machine, toolpath: Toolpath) -> tuple[Job, tuple[Finding, ...]]:
    """Choose where the part stands if a job gives no work offset.

    Returns
    -------
    The job with its offset, and what has been chosen; no finding where the offset is given, or where
    `choose_offset` leaves it at 0
    """
    said = "offset" in job.setup.model_fields_set or job.setup.search is not None
    chosen = None if said else choose_offset(toolpath, machine, job.constraints)
    if chosen is None:
        return job, ()
    offset, finding = chosen
    setup = job.setup.model_copy(update={"offset": offset})
    return job.model_copy(update={"setup": setup}), (finding,)


def placed(toolpath: Toolpath, machine: Machine, constraints: Constraints) -> tuple[Toolpath, Machine]:
    """Place the part as a job does, unless the machine's setup was stated; the path's findings say where."""
    chosen = None if machine.setup.stated else choose_offset(toolpath, machine, constraints)
    if chosen is None:
        return toolpath, machine
    offset, finding = chosen
    there = machine.with_setup(offset, machine.setup.rotation_deg)
    return replace(toolpath, findings=(*toolpath.findings, finding)), there


def choose_offset(
    toolpath: Toolpath, machine: Machine, constraints: Constraints
) -> tuple[Triple, Finding] | None:
    """Choose a work offset where none was given.

    The part stands on the table's centre (`table_centre`) if the path is reached there; else at the nearest
    place on the table or above it, rounded to mm, at which as much of it is reached as can be found.

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
    reach = Reach.of(toolpath, machine, constraints, machine.setup.rotation_deg)
    centre = table_centre(machine)
    offset, why = centre, "no work offset was given"
    if not reach.reached(centre).all():
        missed = int((~reach.reached(centre)).sum())
        offset = reach.nearest(centre)
        why += f", and on the table's centre {missed} of {len(reach)} tried locations can't be reached"
    if offset == (0.0, 0.0, 0.0):
        return None
    message = f"part placed at {_words(offset)}: {why}; --work-offset says otherwise"
    return offset, Finding(Severity.WARNING, "part-placed", message)


def advised(fault: Infeasible, job: Job, machine: Machine, toolpath: Toolpath) -> Infeasible:
    """Add to a fault where the part could stand so that every location is reached; unchanged if nowhere."""
    if job.constraints.hold or not any(finding.code == "no-posture" for finding in fault.findings):
        return fault
    reach = Reach.of(toolpath, machine, job.constraints, job.setup.rotation)
    if not len(reach) or reach.reached(job.setup.offset).all():
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


@dataclass(frozen=True, eq=False)
class Reach:
    """Postures of some locations of a path, with the axis values that they need wherever the part stands.

    With the rotary angles given, the linear axes' values are linear in the work offset.

    Parameters
    ----------
    positions : (n, m, l), mm, of the linear axes with the offset 0
    allowed : (n, m), postures that the bounds and the rotary axes allow
    slopes : (n, m, l, 3), mm per mm of offset
    low, high : (l,), mm, limits
    """

    positions: Array
    allowed: BoolArray
    slopes: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, toolpath: Toolpath, machine: Machine, constraints: Constraints, rotation: Triple) -> Reach:
        """Sample tool axes within the bounds at some of the locations where a cut begins or ends."""
        zoned = constraints.zoned(toolpath)
        tilt = constraints.lean_bounds(zoned)
        known = np.flatnonzero(zoned.bounding & np.isfinite(tilt.reference).all(axis=1))
        rows = _spread(zoned.pivot, known)
        leans = np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, RINGS)
        turns = np.linspace(0.0, 2.0 * np.pi, AXES_PER_RING, endpoint=False)
        reference = tilt.reference[rows]
        across = perpendicular(reference)
        beside = np.cross(reference, across)
        axes = [
            np.cos(lean) * reference + np.sin(lean) * (np.cos(turn) * across + np.sin(turn) * beside)
            for lean, turn in itertools.product(leans, turns)
        ]
        # For each tool axis and branch: (axes, branches, n, …).
        rotary = np.stack(
            [
                into_limits(machine, hold_singular(rotary_angles(machine, axis), axis, machine))
                for axis in axes
            ]
        )
        located = zoned.at(rows)
        tips = np.stack([located.tips(axis) for axis in axes])[:, None]
        zero, *shifted = (
            linear_positions(machine.with_setup(offset, rotation), tips, rotary)
            for offset in ((0.0, 0.0, 0.0), *map(as_triple, np.eye(3)))
        )
        admitted = np.stack([tilt.admits(axis, rows) for axis in axes])[:, None]
        allowed = within_limits(_endless(machine), zero) & admitted
        columns = machine.linear_columns
        slopes = np.stack([(one - zero)[..., columns] for one in shifted], axis=-1)

        def by_location(found: NDArray[Any]) -> NDArray[Any]:
            return np.moveaxis(found.reshape(-1, *found.shape[2:]), 0, 1)

        return cls(
            np.nan_to_num(by_location(zero[..., columns])),
            by_location(allowed),
            np.nan_to_num(by_location(slopes)),
            machine.low[columns],
            machine.high[columns],
        )

    def __len__(self) -> int:
        return len(self.positions)

    def excess(self, offset: Triple, margin: Array | float = 0.0) -> Array:
        """Compute how far the best posture is beyond the linear limits, (n,) mm; negative inside."""
        positions = self.positions + product(self.slopes, np.array(offset))
        past = np.max(np.maximum(positions - self.high, self.low - positions) + margin, axis=2)
        return np.asarray(np.where(self.allowed, past, np.inf).min(axis=1))

    def reached(self, offset: Triple) -> BoolArray:
        """Check which locations have a posture within all limits, (n,)."""
        return np.asarray(self.excess(offset) <= 0.0)

    def nearest(self, start: Triple) -> Triple:
        """Find a place, no lower than `start` and near it, at which most locations are reached; whole mm."""
        if not len(self):
            return start
        span = self.high - self.low
        margin = np.minimum(MARGIN, MARGIN_SHARE * span)
        best, least = np.array(start), math.inf

        def cost(offset: Array) -> float:
            nonlocal best, least
            # A posture that no place allows counts as a metre, and so does a mm into the table.
            past = np.clip(self.excess(as_triple(offset), margin), 0.0, 1000.0)
            sunk = 1000.0 * len(self) * max(start[2] - offset[2], 0.0)
            found = float(past.sum() + sunk + ASIDE * np.linalg.norm(offset - start, axis=-1))
            if found < least:
                best, least = offset, found
            return found

        side = 2.0 * float(np.max(span[np.isfinite(span)], initial=MARGIN))
        for size in (side, AROUND * side):
            origin = best
            search_box(lambda u: cost(np.round(origin + (u - 0.5) * size)), np.full(3, 0.5), TRIES)  # noqa: B023
        return as_triple(best + 0.0)  # no -0


def _spread(pivot: Array, rows: IntArray) -> IntArray:
    """Choose locations evenly along a path, and those at its ends in each direction."""
    if not len(rows):
        return rows
    even = rows[np.unique(np.linspace(0, len(rows) - 1, LOCATIONS).astype(np.int64))]
    ends = [rows[f(pivot[rows, k])] for f in (np.argmin, np.argmax) for k in range(3)]
    return np.unique(np.concatenate([even, ends]))


def _endless(machine: Machine) -> Machine:
    """Return the machine without limits of its linear axes."""
    axes = tuple(axis if axis.is_rotary else replace(axis, limits=Limits()) for axis in machine.axes)
    return replace(machine, axes=axes)


def _words(offset: Triple) -> str:
    return " ".join(f"{letter}{value:g}" for letter, value in zip("XYZ", offset, strict=True))


def _numbers(offset: Triple) -> str:
    return ",".join(f"{value:g}" for value in offset)
