"""NC programs and motion tables, byte for byte.

A difference means that what reaches a machine has changed. Look at it, and if it is meant, regenerate
the files: ``FIVEAXIS_WRITE_GOLDEN=1 pytest tests/golden``.
"""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.unverified_text import write_text

from fiveaxis.model import (
    Machine,
    Motion,
    MoveKind,
    Tool,
    Toolpath,
    block_times,
    follow,
    load_machine,
    tool_poses,
)
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program, read_program, write_motion

GOLDEN = Path(__file__).parent
HEADER = {"tool": "ball:10", "source": "five-points.apt", "energy": "7424 J (feed drives)"}
SETTINGS = ProgramSettings(
    tool_number=3, spindle_rpm=8000, coolant="flood", retract=0.0, home="XY", line_numbers=10
)
# Machine, control, coordinates, and settings in one case of each control.
CASES = [
    ("hayashi-640123", "linuxcnc", "axes", None),
    ("linuxcnc-xyzac-trt", "linuxcnc", "axes", None),
    ("linuxcnc-xyzac-trt", "linuxcnc", "tip", SETTINGS),
    ("linuxcnc-xyzac-trt", "linuxcnc-switchkins", "axes", None),
    ("umc-750", "haas", "axes", None),
    ("umc-750", "haas", "tip", SETTINGS.model_copy(update={"number": 12, "work_offset": "G154 P3"})),
    ("variaxis-630", "fanuc", "axes", None),
    ("variaxis-630", "fanuc", "tip", SETTINGS.model_copy(update={"length_offset": 13})),
    ("variaxis-630", "fanuc", "vector", None),
    ("dmu80p-duoblock", "sinumerik", "axes", None),
    ("dmu80p-duoblock", "sinumerik", "tip", SETTINGS),
    ("dmu80p-duoblock", "sinumerik", "vector", None),
    ("dmu50ev", "heidenhain", "tip", SETTINGS.model_copy(update={"line_numbers": None})),
    ("dmu50ev", "heidenhain", "vector", None),
    ("dmu50ev", "heidenhain-m128", "tip", None),
    ("hayashi-640123", "apt", "vector", None),
    ("hayashi-640123", "points", "vector", None),
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


def posture_of(machine: Machine) -> Motion:
    """The slope where it fits the machine's travel, else five positions around its middle."""
    if machine.letters == "XYZAC":
        motion = five_points(machine)
        if ((motion.positions >= machine.low) & (motion.positions <= machine.high)).all():
            return motion
    limits = [axis.limits for axis in machine.axes]
    middle = [(a.low + a.high) / 2.0 if np.isfinite([a.low, a.high]).all() else 0.0 for a in limits]
    steps = [[0, 0, 0, 0, 0], [3, 4, -2, 5, 10], [3, 4, -2, 5, 40], [-7, 9, 1, -8, 40], [-7, 9, 31, -8, 40]]
    return replace(
        five_points(load_machine("hayashi-640123")),
        letters=machine.letters,
        positions=np.array(middle) + np.array(steps) * [1, 1, 1, np.pi / 180, np.pi / 180],
        time=np.array([0.0, 0.5, 0.4, 0.25, 0.1]),
    )


def timed(motion: Motion, machine: Machine, coordinates: str) -> Motion:
    """Let a motion last as long as its tip takes at its feed, as programs under TCP do."""
    if coordinates == "axes":
        return motion
    tip, axis = tool_poses(machine, motion.positions)
    path = Toolpath.from_tips(tip, axis, Tool.ball(10), feed_mm_min=60.0 * motion.feed, kind=motion.kind)
    return replace(motion, time=block_times(path, machine, motion.positions, by_tip=True))


def hold(path: Path, name: str) -> None:
    """Hold a file to its golden one."""
    if os.environ.get("FIVEAXIS_WRITE_GOLDEN"):
        (GOLDEN / name).write_bytes(path.read_bytes())
    assert path.read_bytes() == (GOLDEN / name).read_bytes()


@pytest.mark.parametrize(("name", "control", "coordinates", "around"), CASES)
def test_a_program_has_the_bytes_of_its_golden_file(tmp_path, name, control, coordinates, around):
    machine = load_machine(name)
    path = write_text(
        timed(posture_of(machine), machine, coordinates),
        tmp_path / "part.nc",
        machine=machine,
        control=control,
        coordinates=coordinates,
        header=HEADER,
        settings=around,
    )
    kind = "" if coordinates == "axes" else f"_{coordinates}"
    hold(path, f"{control}_{name}{kind}{DIALECTS[control].suffix}")


@pytest.mark.parametrize("winding", ["modulo", "rezero"])
def test_a_winding_has_the_bytes_of_its_golden_file(tmp_path, winding):
    machine = load_machine("hayashi-640123")
    short = five_points(machine)
    angles = np.radians([[0, 0], [-190, 45 / 2], [-450, 25], [-500, 30], [-500, 30]])
    positions = short.positions.copy()
    positions[:, [machine.column("C"), machine.column("A")]] = angles
    motion = replace(short, positions=positions, time=np.array([0.0, 1.0, 2.0, 1.0, 1.0]))
    path = write_text(motion, tmp_path / "part.ngc", machine=machine, header=HEADER, winding=winding)
    hold(path, f"linuxcnc_hayashi-640123_{winding}.ngc")


@pytest.mark.parametrize(
    ("name", "control", "coordinates"), [case[:3] for case in CASES if case[2] != "vector"]
)
def test_a_golden_program_is_read_with_all_blocks_around_its_moves(name, control, coordinates):
    machine = load_machine(name)
    kind = "_tip" if coordinates == "tip" else ""
    (file,) = GOLDEN.glob(f"{control}_{name}{kind}.*")
    places = read_program(file, machine, rapid=20_000.0).positions
    wanted = posture_of(machine).positions
    near = np.abs(places[None] - wanted[:, None]).max(axis=2) < 2e-3
    assert near.any(axis=1).all()
    # In their order.
    assert (np.diff(near.argmax(axis=1)) > 0).all()


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt"])
def test_a_motion_table_has_the_bytes_of_its_golden_file(tmp_path, name):
    machine = load_machine(name)
    hold(write_motion(five_points(machine), tmp_path / "motion.csv", machine), f"motion_{name}.csv")


def test_every_control_has_a_golden_file():
    assert {(control, coordinates) for _, control, coordinates, _ in CASES} >= {
        (name, coordinates)
        for name, dialect in DIALECTS.items()
        for coordinates in dialect.modes
        if not name.endswith(("-switchkins", "-m128"))
    }
    assert {control for _, control, _, _ in CASES} == set(DIALECTS)


@pytest.mark.parametrize(("name", "control", "coordinates", "around"), CASES)
def test_what_a_program_needs_is_what_its_text_says(name, control, coordinates, around):
    machine = load_machine(name)
    program = compose_program(
        posture_of(machine), machine=machine, control=control, coordinates=coordinates, settings=around
    )
    needs, is_list = program.preparation, DIALECTS[control].language != "blocks"
    words = re.sub(r"(?m)^\d+ |[\W_]+", "", program.text).upper()
    for note in needs.notes:
        assert re.sub(r"[\W_]+", "", note.head.replace("°", " deg")).upper() in words, note
    # The header is read before the start: what is needed there, and no more.
    assert {note.about for note in needs.notes if note.head} >= {"work offset", "tool", "start"} or is_list
    assert sum(bool(re.match(r"(?:N?\d+ )?[(;$#]", line)) for line in program.lines) <= 17
    for block in needs.in_force:
        assert any(block in line for line in program.lines), block
    assert DIALECTS[control].language != "blocks" or [letter for letter, _ in needs.start][-3:] == list("XYZ")
    for letter, value in needs.start:
        assert re.search(rf"{letter}(=DC\()?[+]?{re.escape(f'{value:.3f}'[:-2])}", program.text), letter
