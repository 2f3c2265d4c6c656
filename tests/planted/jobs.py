"""Clean jobs: what the project writes for them has nothing wrong, and verification must say so."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from support.pairwise_cases import Case

import fiveaxis as fx
from fiveaxis.base import Array
from fiveaxis.base.errors import ToolpathError
from fiveaxis.check import verify_program
from fiveaxis.model import Tool, Toolpath
from fiveaxis.nc import ProgramSettings, write_motion
from planted.trial import ASKED, OFFSETS, RETRACT, Count, Trial, Verdict, two_passes, verdict_of

# What jobs ask of programs, one at a time and together; a control without the words leaves them out.
SETTINGS: dict[str, dict[str, Any]] = {
    "nothing": {},
    "tool": {"tool_number": 12},
    "spindle": {"spindle_rpm": 12000.5},
    "spindle to the left": {"spindle_rpm": 500.0, "spindle_direction": "left"},
    "coolant": {"coolant": "flood"},
    "block numbers": {"line_numbers": 10},
    "inch": {"unit": "inch"},
    "no way out": {"way_out": False},
    "retract": {"retract": RETRACT},
    "all in inch": ASKED | {"unit": "inch", "line_numbers": 5},
}


def of_settings(solution: fx.Solution, control: str, mode: str, folder: Path) -> Count:
    """Write a program with each of the settings, and count what is found in it."""
    tally = Count()
    for name, asked in SETTINGS.items():
        settings = ProgramSettings(**asked, **(OFFSETS.get(control, {}) if name == "all in inch" else {}))
        trial = Trial(solution, control, mode, settings)
        found = {"gate": verdict_of(lambda trial=trial: trial.made.report)}
        if "SettingError" in found["gate"].errors:
            # The control has no words for it.
            continue
        if not found["gate"].errors:
            found["program"] = trial.by_program(trial.text, folder)
        _add(tally, name, found)
    return tally


def _add(tally: Count, name: str, found: dict[str, Verdict]) -> None:
    tally.made += 1
    tally.false_alarms += any(verdict.errors for verdict in found.values())
    for check, verdict in found.items():
        if verdict.errors:
            tally.missed.append(f"{name} by {check}: {dict(verdict.errors)}")


def box(tool: Tool) -> Toolpath:
    """A pass around a box with sharp corners, whose walls overhang."""
    rows: list[Array] = []
    normals: list[Array] = []
    for turn in np.radians([0.0, 90.0, 180.0, 270.0]):
        across = np.array([np.cos(turn), np.sin(turn), 0.0])
        along = np.array([-np.sin(turn), np.cos(turn), 0.0])
        for place in np.linspace(-20.0, 20.0, 9):
            rows.append(25.0 * across + place * along + [0.0, 0.0, 20.0])
            normals.append(across - [0.0, 0.0, 0.3])
    return Toolpath.from_contacts(rows, normals, tool, name="box")


def ramp(tool: Tool) -> Toolpath:
    """A pass on a wall with a blunt corner, from level to a ramp."""
    x = np.linspace(0.0, 40.0, 21)
    up = x >= 20.0
    contact = np.column_stack([x - 20.0, np.full_like(x, 25.0), np.where(up, 12.0 + 0.4 * x, 20.0)])
    normal = np.column_stack([np.where(up, -0.37, 0.0), np.full_like(x, 0.8), np.full_like(x, 0.6)])
    return Toolpath.from_contacts(contact, normal, tool, name="ramp")


TOOLS = {
    "ball": (Tool.ball(8), (15.0, 75.0)),
    "bull": (Tool.bull(12, 3), (10.0, 60.0)),
    "flat": (Tool.flat(8), (5.0, 60.0)),
    "lollipop": (Tool.lollipop(8, 4), (15.0, 75.0)),
}
PATHS = {
    "rapids": lambda tool: two_passes(tool),
    "rapids, upright": lambda tool: two_passes(tool, rise=0.3),
    "links": lambda tool: two_passes(tool, rapid=False),
    "box": box,
    "ramp": ramp,
}


@dataclass(frozen=True)
class Job:
    """A path for a tool on a machine."""

    name: str
    path: Toolpath
    machine: fx.Machine
    tilt: tuple[float, float]


def jobs(pick: Callable[[Iterable[Case]], Iterable[Case]] = list) -> list[Job]:
    """Return jobs of every tool and kind of path on two machines, or those that are picked."""
    hayashi = fx.load_machine("hayashi-640123")
    trunnion = fx.load_machine("linuxcnc-xyzac-trt").with_drives_of(hayashi)
    machines = {machine.name: machine for machine in (hayashi, trunnion)}
    found = []
    for machine, tool_name, path_name in pick(product(machines, TOOLS, PATHS)):
        tool, tilt = TOOLS[tool_name]
        name = f"{tool_name} {path_name} on {machine}"
        found.append(Job(name, PATHS[path_name](tool), machines[machine], tilt))
    return found


def of_job(job: Job, folder: Path) -> Count:
    """Solve a job, and count what is found in its motion's table and its programs."""
    tally = Count()
    solution = fx.optimise(job.path, job.machine, tilt=job.tilt, effort="quick")

    def verified(file: Path) -> Verdict:
        return verdict_of(lambda: verify_program(file, job.machine, toolpath=job.path, tilt=job.tilt))

    table = write_motion(solution.motion, folder / "motion.csv", job.machine)
    _add(tally, f"{job.name}: motion.csv", {"verify": verified(table)})
    for control, mode in (("linuxcnc", "axes"), ("fanuc", "tip"), ("heidenhain", "tip")):
        try:
            made = solution.program(control=control, coordinates=mode)
        except ToolpathError as refusal:
            # A block whose F the control can't read is refused: nothing is written.
            if "lower the feed" not in str(refusal):
                raise
            continue
        if not made.ok:
            continue
        file = made.write(folder / f"program{made.text.suffix}")
        _add(tally, f"{job.name}: {control} {mode}", {"verify": verified(file)})
    return tally
