"""The cut of a job or a program, in the units of the shop: its engagement and its mean power."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from fiveaxis.base import JobError, SettingError, StrictModel, ToolError, explain, read_settings
from fiveaxis.lab.cutting.budget import Process
from fiveaxis.lab.cutting.cutting_forces import CuttingCoefficients
from fiveaxis.lab.cutting.drilling import Drill
from fiveaxis.lab.cutting.engagement import EndMill
from fiveaxis.model import Tool, parse_tool


class ProcessTable(StrictModel):
    """The cut, the same along the whole path; for the energy of the whole job and `fiveaxis energy`."""

    spindle_rpm: float = Field(gt=0.0, description="speed of the spindle, rev/min", examples=[8000])
    teeth: int = Field(ge=1, description="teeth of the cutter, or lips of the drill", examples=[2])
    helix: float = Field(0.0, gt=-90.0, lt=90.0, description="helix angle of the teeth, deg")
    depth: float | None = Field(
        None, ge=0.0, description="depth of cut along the surface normal, mm; of end mills", examples=[0.3]
    )
    width: float | None = Field(
        None, ge=0.0, description="distance of the passes, mm; of end mills", examples=[0.5]
    )
    web: float | None = Field(
        None, ge=0.0, description="diameter of a drill's core, mm; 0 by default", examples=[1.5]
    )
    feed_force: float | None = Field(
        None, ge=0.0, description="force of the cut against the feed, N; of end mills", examples=[60]
    )
    tangential: float = Field(gt=0.0, description="cutting coefficient K_tc, N/mm2", examples=[800])
    tangential_edge: float = Field(0.0, ge=0.0, description="edge coefficient K_te, N/mm")
    thrust: float | None = Field(
        None, ge=0.0, description="thrust coefficient K_zc, N/mm2; of drills", examples=[1500]
    )
    thrust_edge: float = Field(0.0, ge=0.0, description="thrust's edge coefficient K_ze, N/mm; of drills")
    basis: Literal["measured", "fitted", "assumed"] = Field(
        description="what the coefficients rest on", examples=["assumed"]
    )
    source: str = Field(
        min_length=1,
        description="where the coefficients come from, or why they are assumed",
        examples=["where the coefficients come from"],
    )


# A process file, or its keys.
ProcessFigures = str | Path | Mapping[str, Any]
OF_MILLS, OF_DRILLS = ("depth", "width"), ("thrust",)


def cutting_power(tool: Tool | str, process: ProcessFigures, feed_mm_min: float) -> float:
    """Compute the mean power of a cut with an end mill or a drill, in the units of the shop.

    Parameters
    ----------
    tool : the cutter, or its short form or file: ``flat:10``, ``ball:8``, ``drill:10:118``
    process : the keys of a job's ``[process]`` (rev/min, mm, N/mm²), or a TOML file of them
    feed_mm_min : mm/min

    Returns
    -------
    W, at the spindle; of a drill with what its thrust takes

    Raises
    ------
    FiveAxisError
        A figure is missing, out of its range or not one of the cutter; the engagement is impossible.

    References
    ----------
    Lee and Altintas (1996) for end mills; Wang et al. (2019) for drills.
    """
    cutter = parse_tool(tool) if isinstance(tool, str) else tool
    feed = feed_mm_min / 60.0
    return float(make_process(read_process(process), cutter, feed).power(np.array([feed]))[0])


def read_process(process: ProcessFigures) -> ProcessTable:
    """Read the keys of a process from its file or from a mapping, whose coefficients may lack their source.

    `JobError` if a key is unknown or missing, or its value out of its range.
    """
    if isinstance(process, str | Path):
        return read_settings(Path(process), ProcessTable, JobError)
    given = {"basis": "assumed", "source": "given in code", **process}
    try:
        return ProcessTable.model_validate(given)
    except ValidationError as fault:
        raise JobError(f"process: {explain(fault, ProcessTable, given)}") from None


def make_process(table: ProcessTable, tool: Tool, feed: float) -> Process:
    """Make the engagement of a cutter, and check it.

    Parameters
    ----------
    tool : the cutter
    feed : mm/s, the highest

    Raises
    ------
    JobError
        The cutter is neither a ball, a flat end mill nor a drill; a figure is missing or isn't one of it; the
        engagement is impossible.
    """
    shape, drills = tool.cutter.shape, tool.cutter.shape == "drill"
    if shape not in ("ball", "flat", "drill"):
        raise JobError(
            f"process: cutting power is known for ball and flat end mills and for drills; the tool is {tool}"
        )
    needed, foreign = (OF_DRILLS, (*OF_MILLS, "feed_force")) if drills else (OF_MILLS, (*OF_DRILLS, "web"))
    missing = [name for name in needed if getattr(table, name) is None]
    if missing:
        raise JobError(f"process: the cut of {tool} needs {' and '.join(missing)}; add it")
    unused = [name for name in foreign if getattr(table, name) is not None]
    if unused:
        raise JobError(f"process: {', '.join(unused)} isn't a figure of {tool}; leave it out")
    try:
        process = Process(
            mill=_drill(table, tool) if drills else _end_mill(table, tool),
            depth=table.depth or 0.0,
            width=table.width or 0.0,
            spindle=table.spindle_rpm * 2.0 * math.pi / 60.0,
            coefficients=CuttingCoefficients(
                table.tangential, table.tangential_edge, table.thrust or 0.0, table.thrust_edge
            ),
            basis=table.basis,
            source=table.source,
            feed_force=table.feed_force,
        )
        process.power(np.array([feed]))
    except (SettingError, ToolError) as fault:
        raise JobError(f"process: {fault.message}") from None
    return process


def _end_mill(table: ProcessTable, tool: Tool) -> EndMill:
    shape: Literal["ball", "flat"] = "ball" if tool.cutter.shape == "ball" else "flat"
    return EndMill(shape, tool.diameter, table.teeth, math.radians(table.helix))


def _drill(table: ProcessTable, tool: Tool) -> Drill:
    point = math.radians(tool.cutter.figures[1])
    return Drill(tool.diameter, table.web or 0.0, point / 2.0, table.teeth)
