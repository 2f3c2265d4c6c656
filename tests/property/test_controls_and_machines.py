"""Every control writes for every machine what it reads again, in each way that control or machine has."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.pairwise_cases import pairwise_cover

from fiveaxis.base import Array
from fiveaxis.base.errors import FiveAxisError
from fiveaxis.model import Machine, Motion, MoveKind, Tool, load_machine, machine_names, tool_poses
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program, read_program, read_toolpath

KINDS = [MoveKind.CUT, MoveKind.CUT, MoveKind.CUT, MoveKind.CUT, MoveKind.RAPID, MoveKind.LINK]
SHARES = np.array([0.4, 0.5, 0.5, 0.6, 0.45, 0.4])
# deg, of an axis with more than a turn: half a turn at once, past whole ones and back.
WINDING = np.array([170.0, 185.0, 350.0, 350.0, 365.0, 20.0])
# mm/min and deg/min, of axes in rapid moves whose highest speed the machine doesn't tell.
RAPID = 6000.0
# Of a move's time: what rounded words and F leave of it.
TIME = 1e-3

known_machine = cache(load_machine)


def refusal(name: str, control: str, coordinates: str, winding: str, _: str) -> str | None:
    """Why a machine can't be written for in a way; None where it can."""
    machine = known_machine(name)
    if coordinates != "axes" and DIALECTS[control].language == "blocks" and not machine.rotaries:
        return "no rotary axis"
    turns = machine.high - machine.low
    bounded = any(turns[c] > 2.0 * np.pi and np.isfinite(turns[c]) for c in machine.rotary_columns)
    return "would lose which turn it is on" if winding == "modulo" and bounded else None


PRODUCT = [
    (name, control, coordinates, winding, unit)
    for name in machine_names()
    for control, dialect in DIALECTS.items()
    for coordinates in dialect.modes
    for winding in (dialect.windings if coordinates != "vector" else ("unwound",))
    for unit in dialect.unit
]
WRITTEN = pairwise_cover(case for case in PRODUCT if refusal(*case) is None)
REFUSED = pairwise_cover(case for case in PRODUCT if refusal(*case) is not None)


@cache
def short_motion(name: str) -> Motion:
    """All axes move, then rotary ones alone, linear ones alone; a rapid move and a link."""
    machine = known_machine(name)
    reach = np.array([{"X": 30.0, "Y": 25.0, "Z": 20.0}.get(letter, 1.0) for letter in machine.letters])
    middle = np.clip(0.0, machine.low + reach, machine.high - reach)
    positions = middle + (2.0 * SHARES[:, None] - 1.0) * reach
    rotary, wide = machine.rotary_columns, machine.high - machine.low > 2.0 * np.pi
    positions[2, rotary or machine.linear_columns] += 0.2
    positions[3, rotary] = positions[2, rotary]
    for column in rotary:
        if wide[column]:
            positions[:, column] = np.radians(WINDING)
    time = np.array([0.0, 2.0, 3.0, 1.5, 0.8, 4.0])
    return Motion(machine.letters, positions, np.full(6, 10.0), time, np.array(KINDS), np.arange(6))


def require_path(file: Path, motion: Motion, machine: Machine, control: str) -> None:
    """Hold tips and directions to the decimals that are printed."""
    path, number = read_toolpath(file, tool=Tool.ball(6), machine=machine), DIALECTS[control].number
    tips, axes = tool_poses(machine, motion.positions)
    np.testing.assert_allclose(path.tips(path.axis)[-len(tips) :], tips, atol=3.0 * 10.0**-number.linear)
    # The first direction is that of the angles which the approach turns to.
    np.testing.assert_allclose(path.axis[-len(axes) :], axes, atol=2.0 * 10.0**-number.direction + 2e-6)


def timed_as(again: Motion, motion: Motion) -> Array:
    """Give the times of a program's rows, but its rapid move, the last one, that of the motion.

    A rapid move has no time of its own in a program; it takes its axes'.
    """
    time, quick = again.time.copy(), np.flatnonzero(again.rapid)
    move = quick[np.flatnonzero(np.diff(quick, prepend=-2) > 1)[-1] :]
    time[move] *= motion.time[motion.rapid].sum() / time[move].sum()
    return time


def require_motion(
    file: Path, motion: Motion, machine: Machine, control: str, *, tips: bool, turns: bool
) -> None:
    """Hold places to the decimals that are printed, and times; `turns` where whole ones may be lost."""
    again, number = read_program(file, machine, rapid=RAPID), DIALECTS[control].number
    # Parts of long turns are blocks of their own: rows are found again by the time that is left after them.
    left, wanted = (np.cumsum(t[::-1])[::-1] - t for t in (timed_as(again, motion), motion.time))
    rows = np.abs(left[None] - wanted[:, None]).argmin(axis=1)
    np.testing.assert_array_equal(again.rapid[rows[1:]], motion.rapid[1:])
    np.testing.assert_allclose(-np.diff(left[rows]), motion.time[1:], rtol=TIME)
    places, rotary, linear = again.positions[rows], machine.rotary_columns, machine.linear_columns
    if turns:  # on which of them an axis begins isn't in words from 0 to 360
        whole = np.rint((motion.positions[0] - places[0]) / (2.0 * np.pi))
        places[:, rotary] += 2.0 * np.pi * whole[rotary]
    angles, asked = (np.degrees(p[:, rotary]) for p in (places, motion.positions))
    np.testing.assert_allclose(angles, asked, atol=0.51 * 10.0**-number.rotary)
    if tips:
        got, aim = tool_poses(machine, places)[0], tool_poses(machine, motion.positions)[0]
    else:
        got, aim = places[:, linear], motion.positions[:, linear]
    np.testing.assert_allclose(got, aim, atol=3.0 * 10.0**-number.linear)


@pytest.mark.parametrize(("name", "control", "coordinates", "winding", "unit"), WRITTEN)
def test_a_program_is_read_as_its_motion(name, control, coordinates, winding, unit, tmp_path_factory):
    machine, motion = known_machine(name), short_motion(name)
    asked = {"coordinates": coordinates, "winding": winding, "settings": ProgramSettings(unit=unit)}
    program = compose_program(motion, machine=machine, control=control, **asked)
    assert program.dropped == 0
    # One file for all: a folder for each takes longer than the program.
    file = tmp_path_factory.getbasetemp() / f"part{program.suffix}"
    file.write_text(program.text, encoding="ascii")
    if coordinates == "vector":
        require_path(file, motion, machine, control)
    else:
        require_motion(file, motion, machine, control, tips=coordinates == "tip", turns=winding == "modulo")


@pytest.mark.parametrize(("name", "control", "coordinates", "winding", "unit"), REFUSED)
def test_a_way_that_a_machine_lacks_is_refused(name, control, coordinates, winding, unit):
    asked = {"coordinates": coordinates, "winding": winding, "settings": ProgramSettings(unit=unit)}
    with pytest.raises(FiveAxisError, match=refusal(name, control, coordinates, winding, unit)):
        compose_program(short_motion(name), machine=known_machine(name), control=control, **asked)
