"""What a job's program adds to its motion, checked before the gate."""

from __future__ import annotations

from dataclasses import replace

from fiveaxis.collision import Surroundings
from fiveaxis.job.blocks import ProgramMotion
from fiveaxis.job.description import Job
from fiveaxis.nc.writing.places import Wording
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import with_approach


def with_way_in(
    program: ProgramMotion, toolpath: Toolpath, wording: Wording, job: Job, around: Surroundings
) -> ProgramMotion:
    """Choose a clear way to the first location of a job's program, and say in its verdict what was checked.

    A list of cutter locations has no approach of ours.
    """
    if wording.dialect.language != "blocks":
        return program
    verdict = with_approach(
        program.verdict,
        program.motion,
        wording.machine,
        toolpath,
        surroundings=around,
        leg=wording.coordinates == "axes",
        way_out=job.nc.retract is not None or job.nc.home.partition(" ")[0] == "Z",
        rows=len(program.driven),
    )
    return replace(program, verdict=verdict)
