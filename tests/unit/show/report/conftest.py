"""A solution made by hand: the vase tilted up by 15°, compared with the same tilted by 45°."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds

from fiveaxis.base import normalise
from fiveaxis.base.findings import JOB, Finding, Place, Severity, risk
from fiveaxis.check import Report
from fiveaxis.check.verification.report import Check
from fiveaxis.model import (
    Machine,
    Motion,
    Toolpath,
    divided_rows,
    follow,
    motion_energy,
    predicted_time,
    refined,
    rotary_angles,
)
from fiveaxis.nc.program import Preparation
from fiveaxis.nc.writing.header import Note
from fiveaxis.posture import Baseline, Optimum, SolverStep
from fiveaxis.show import ReportDocument, write_report
from fiveaxis.show.report import page as page_module
from fiveaxis.show.report.facts import ProgramFigures

PREPARATION = Preparation(
    notes=(
        Note("start", "start with the tool clear of part and table"),
        Note("work offset", "zero: the work offset is the workpiece origin"),
        Note("tool", "tool length: measure it"),
        Note("control", "parameter 19696 bit 5 is 0"),
    ),
    tool_number=3,
    work_offset="G55",
    in_force=("G21 G90", "G55", "T3 M6", "G0 G43.4 H3"),
    start=(("A", -45.0), ("C", 0.12345), ("X", 1.5), ("Y", -2.0), ("Z", 408.8567)),
)
STAGES = (
    SolverStep("grid search, stride 30", "found", None, 12_000.5),
    SolverStep("refine the grid's start", "Solve_Succeeded", 12_000.5, 11_306.0),
)


def tilted_up(toolpath: Toolpath, machine: Machine, degrees: float) -> Motion:
    """Tilt the tool from the normal towards +z."""
    up = np.array([0.0, 0.0, 1.0])
    across = normalise(up - (toolpath.normal @ up)[:, None] * toolpath.normal)
    tilt = math.radians(degrees)
    axis = toolpath.normal * math.cos(tilt) + across * math.sin(tilt)
    return follow(toolpath, machine, np.unwrap(rotary_angles(machine, axis)[1], axis=0))


def solve_by_hand(toolpath: Toolpath, machine: Machine) -> Optimum:
    after, before = (tilted_up(toolpath, machine, degrees) for degrees in (15.0, 45.0))
    return Optimum(
        machine=machine,
        toolpath=toolpath,
        tilt=tilt_bounds(toolpath, tilt=(15.0, 75.0)),
        motion=after,
        energy=motion_energy(machine, after),
        compared={"normal": Baseline(before, motion_energy(machine, before))},
        missing={"as-programmed": "the input has no tool axes"},
        stages=STAGES,
    )


@pytest.fixture(scope="session")
def part_of_vase(vase: Toolpath) -> Toolpath:
    """Every tenth location: enough to draw, quick to solve."""
    return Toolpath.from_contacts(
        vase.contact[::10], vase.normal[::10], vase.tool, source=vase.source[::10], name=vase.name
    )


@pytest.fixture(scope="session")
def solution(part_of_vase: Toolpath, hayashi: Machine) -> Optimum:
    return solve_by_hand(part_of_vase, hayashi)


@pytest.fixture(scope="session")
def long_solution(part_of_vase: Toolpath, hayashi: Machine) -> Optimum:
    """The same path with a hundred times its locations."""
    path = refined(part_of_vase, divided_rows(np.full(len(part_of_vase) - 1, 100)))
    return solve_by_hand(replace(path, numbers=None), hayashi)


@pytest.fixture(scope="session")
def solution_with_base(part_of_vase: Toolpath, hayashi: Machine) -> Optimum:
    return solve_by_hand(part_of_vase, replace(hayashi, base_power=2763.0))


@pytest.fixture(scope="session")
def trunnion_solution(part_of_vase: Toolpath, trunnion: Machine, hayashi: Machine) -> Optimum:
    return solve_by_hand(part_of_vase, trunnion.with_drives_of(hayashi))


def make_finding(location: int, severity: Severity = Severity.ERROR, code: str = "axis-limit") -> Finding:
    message = "A = -131.2 deg is below the limit -120 deg; narrow the tilt range"
    return Finding(severity, code, message, Place(location, location + 1, "vase.csv"), 11.2)


@pytest.fixture
def verdict() -> Report:
    """Verdict of a motion without a fault."""
    return Report(
        findings=(),
        checks={},
        figures={"contact error (mm)": 2.5e-13, "gouge (mm)": None},
        claims=(("axis limits at every location", Check("axis-limit")),),
        gaps=((risk("gouges: no mesh of the part was given", "part (--part)", JOB), None),),
    )


@pytest.fixture
def unsafe_verdict(verdict: Report) -> Report:
    """Verdict with more than a thousand violations, of which 150 are listed."""
    findings = [make_finding(i, Severity.WARNING, "tip-deviation") for i in range(30)]
    findings += [make_finding(i) for i in range(120)]
    checks = {Check("axis-limit"): 1_500, Check("tip-deviation"): 30}
    return replace(verdict, findings=tuple(findings), checks=checks)


@pytest.fixture
def program(solution: Optimum) -> ProgramFigures:
    """Figures of that motion's program: inserted and removed blocks, and what it needs at the machine."""
    return ProgramFigures(
        control="fanuc",
        coordinates="axes",
        language="blocks",
        preparation=PREPARATION,
        blocks=290,
        lines=300,
        blocks_before=360,
        inserted=12,
        removed=82,
        axis_held_in_plane=0,
        axis_left_plane=0,
        redundant_kept_for=(),
        interpolation="joint",
        run_time=predicted_time(solution.motion, solution.machine),
        energy=solution.energy,
        path_tolerance_mm=0.005,
        axis_tolerance_deg=0.02,
    )


# What a page shows of the solution alone, whatever its document says: nearly all the work of a page.
DRAWN = (
    *("energy_bars", "limit_strips", "spending_lines", "axis_lines", "speed_lines", "power_lines"),
    *("path_valley", "draw_valley", "location_surface"),
)


def once(draw: Callable[..., Any], drawn: dict[Any, Any]) -> Callable[..., Any]:
    """Cache drawings of the same objects."""

    def remembered(*given: Any, **more: Any) -> Any:
        key = (draw.__name__, *(g if isinstance(g, str) else id(g) for g in (*given, *more.values())))
        if key not in drawn:
            # What was given is kept: another object can't come to have its id.
            drawn[key] = (draw(*given, **more), given, more)
        return drawn[key][0]

    return remembered


@pytest.fixture(scope="session")
def drawn() -> dict[Any, Any]:
    """Cache the drawings of the pages of these tests."""
    return {}


@pytest.fixture
def page(tmp_path: Path, drawn: dict[Any, Any]) -> Callable[..., str]:
    """Write the page of a solution and read it back."""

    def compose(solution: Optimum, verdict: Report, **more: Any) -> str:
        path = tmp_path / "report.html"
        with pytest.MonkeyPatch.context() as patched:
            for name in DRAWN:
                patched.setattr(page_module, name, once(getattr(page_module, name), drawn))
            write_report(ReportDocument(solution, verdict, **more), path)
        return path.read_text(encoding="utf-8")

    return compose
