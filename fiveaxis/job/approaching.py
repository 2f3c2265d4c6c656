"""What a job's program adds to its motion, checked before the gate."""

from __future__ import annotations

from dataclasses import replace

from fiveaxis.collision import Surroundings
from fiveaxis.job.blocks import ProgramMotion
from fiveaxis.job.description import Job
from fiveaxis.motion import motion_digest
from fiveaxis.nc.writing.places import Wording
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import with_approach


def with_way_in(
    program: ProgramMotion, toolpath: Toolpath, wording: Wording, job: Job, around: Surroundings
) -> ProgramMotion:
    """Choose clear ways in and out of a job's program, and say in its verdict what was checked.

    The verdict rests on all rows of the path, and holds for the blocks that stand for them. A list of cutter
    locations has no approach of ours.
    """
    found = replace(program.verdict, about=motion_digest(program.motion, wording.machine))
    if wording.coordinates != "axes":
        # Rows stand so close that the tip led straight and axes run linearly go the same way.
        found = replace(
            found,
            gouges_between=_on_both_ways(found.gouges_between),
            collisions_between=_on_both_ways(found.collisions_between),
        )
    if wording.dialect.language != "blocks":
        return replace(program, verdict=found)
    verdict = with_approach(
        found,
        program.motion,
        wording.machine,
        toolpath,
        surroundings=around,
        leg=wording.coordinates == "axes",
        way_out=_retract(job),
        leaves=job.nc.way_out,
        rows=len(program.driven),
        gouge_tolerance=job.gouge_tolerance,
    )
    return replace(program, verdict=verdict)


def _on_both_ways(ways: tuple[str, ...] | None) -> tuple[str, ...] | None:
    return ways and ("axes", "led")


def _retract(job: Job) -> float | None:
    """Give the machine's place of Z, mm, to which a job's program goes up at its end, if it does."""
    if job.nc.retract is None and job.nc.home.split()[:1] == ["Z"]:
        return 0.0
    return job.nc.retract
