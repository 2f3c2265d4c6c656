"""A program read as it is, to be shown: its operations in its control's time, each with its cutter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fiveaxis.job.description import Job
from fiveaxis.job.loading import load_job_machine
from fiveaxis.job.program_costs import price_program
from fiveaxis.nc.control.axis_track import RAPID
from fiveaxis.nc.source import load_source
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import parse_tool
from fiveaxis.toolpath.tool import tools_by_number
from fiveaxis.viewer.whole import ShownOperation, WholeProgram


def show_program(
    job: Job, readings: Sequence[Mapping[str, Any]], progress: Progress = unheard
) -> WholeProgram:
    """Read the operations of a job's program as they are.

    Rapid moves of axes without a known speed are shown at `RAPID`, unless the job states one.

    Parameters
    ----------
    job : its machine, setup and tools; what it bounds and minimises isn't used
    readings : how each operation is read, as keywords of `read_program`

    Raises
    ------
    FiveAxisError
        As `read_program`.
    """
    source, machine = load_source(job.input), load_job_machine(job)
    named = "" if job.tool is None else job.tool
    tools = tools_by_number(named) if "=" in named else {"": named}
    parts = []
    for number, reading in enumerate(readings):
        progress("reading the program", number, len(readings))
        priced = price_program(source, machine, {**reading, "rapid": reading.get("rapid") or RAPID})
        motion = priced.motion
        operation = "" if motion.operation is None else motion.operation.tool
        given = tools.get(operation, tools.get(""))
        tool = parse_tool(given) if given else motion.tool
        parts.append(ShownOperation(motion, priced.energy, tool, priced.findings))
    return WholeProgram.of(source.name, machine, source.lines, parts)
