"""NC programs and motion tables, byte for byte.

A difference means that what reaches a machine has changed. Look at it, and if it is meant, write the files
anew: ``FIVEAXIS_WRITE_GOLDEN=1 pytest tests/golden``.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fiveaxis.machine import Machine, load_machine
from fiveaxis.motion import Motion, follow
from fiveaxis.nc import compose_program, write_motion, write_program
from fiveaxis.nc.dialects import DIALECTS
from fiveaxis.toolpath import MoveKind, Tool, Toolpath

GOLDEN = Path(__file__).parent
HEADER = {"tool": "ball:10", "source": "five-points.apt", "energy": "7424 J (feed drives)"}
CASES = [
    ("hayashi-640123", "linuxcnc"),
    ("linuxcnc-xyzac-trt", "linuxcnc"),
    ("linuxcnc-xyzac-trt", "linuxcnc-switchkins"),
]


def five_points(machine: Machine) -> Motion:
    """A short cut over a slope, with a link and a rapid move, C past half a turn."""
    toolpath = Toolpath.from_tips(
        [[10, 0, 0], [10, 5, -3], [0, 15, 4.5], [-20, 15, 8], [-20, 15, 40]],
        np.tile([0.0, 0.0, 1.0], (5, 1)),
        Tool.ball(10),
        feed_mm_min=[600, 600, 1000, 600, 2000],
        kind=[MoveKind.CUT, MoveKind.CUT, MoveKind.LINK, MoveKind.CUT, MoveKind.RAPID],
        source=[3, 4, 6, 7, 9],
    )
    rotary = np.radians([[0, 0], [-90, 45 / 2], [-150, 25], [-200, 30], [-200, 30]])
    return follow(toolpath, machine, rotary)


def hold(path: Path, name: str) -> None:
    """Hold a file to its golden one."""
    if os.environ.get("FIVEAXIS_WRITE_GOLDEN"):
        (GOLDEN / name).write_bytes(path.read_bytes())
    assert path.read_bytes() == (GOLDEN / name).read_bytes()


@pytest.mark.parametrize(("name", "control"), CASES)
def test_a_program_has_the_bytes_of_its_golden_file(tmp_path, name, control):
    machine = load_machine(name)
    motion = five_points(machine)
    path = write_program(motion, tmp_path / "part.ngc", machine=machine, control=control, header=HEADER)
    hold(path, f"{control}_{name}{DIALECTS[control].suffix}")


@pytest.mark.parametrize("winding", ["modulo", "rezero"])
def test_a_way_of_counting_turns_has_the_bytes_of_its_golden_file(tmp_path, winding):
    machine = load_machine("hayashi-640123")
    short = five_points(machine)
    angles = np.radians([[0, 0], [-190, 45 / 2], [-450, 25], [-500, 30], [-500, 30]])
    positions = short.positions.copy()
    positions[:, [machine.column("C"), machine.column("A")]] = angles
    motion = replace(short, positions=positions, time=np.array([0.0, 1.0, 2.0, 1.0, 1.0]))
    path = write_program(motion, tmp_path / "part.ngc", machine=machine, header=HEADER, winding=winding)
    hold(path, f"linuxcnc_hayashi-640123_{winding}.ngc")


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt"])
def test_a_motion_table_has_the_bytes_of_its_golden_file(tmp_path, name):
    machine = load_machine(name)
    hold(write_motion(five_points(machine), tmp_path / "motion.csv", machine), f"motion_{name}.csv")


def test_every_control_has_a_golden_file():
    assert {control for _, control in CASES} == set(DIALECTS)


def test_the_same_motion_gives_the_same_bytes():
    machine = load_machine("hayashi-640123")
    first, second = (compose_program(five_points(machine), machine=machine, header=HEADER) for _ in range(2))
    assert first.text == second.text
