"""Laws of programs for every control: its readers find the motion that was given."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.base import Array, BoolArray, Coordinates
from fiveaxis.base.errors import FiveAxisError, ToolpathError
from fiveaxis.model import Machine, Motion, MoveKind, Tool, load_machine, tool_poses
from fiveaxis.model.motion.timing import rapid_speeds
from fiveaxis.nc import DIALECTS, Program, ProgramSettings, read_program, read_toolpath
from fiveaxis.nc import compose_program as compose_with_way_out

# A way out of the last cut has tests of its own: here the last block is the last move.
compose_program = partial(compose_with_way_out, settings=ProgramSettings(way_out=False))

# Table-table, head-table and head-head; with and without limits, axes that the control counts the other way,
# tools that aren't along Z, offsets between the axes.
MACHINES = [
    "dmu50ev",
    "dmu80p-duoblock",
    "hayashi-640123",
    "linuxcnc-bridgemill",
    "linuxcnc-max5",
    "linuxcnc-xyzac-trt",
    "linuxcnc-xyzbc-trt",
    "pocketnc-v2",
    "umc-750",
    "variaxis-630",
]
# mm/s and deg/s, of axes in rapid moves whose highest speed no machine file tells.
RAPID = 100.0
REACH = {"X": 300.0, "Y": 300.0, "Z": 300.0, "A": 4.0, "B": 4.0, "C": 400.0}
BY_ANGLE = [(n, c) for n, d in DIALECTS.items() for c in d.modes if c != "vector"]
BY_VECTOR = [(n, "vector") for n, d in DIALECTS.items() if "vector" in d.modes]
FEW = settings(max_examples=8)


@st.composite
def motions(draw: st.DrawFn) -> tuple[Machine, Motion]:
    """Any places inside the travel, some of them with linear or rotary axes that stand."""
    machine = load_machine(draw(st.sampled_from(MACHINES)))
    n, k = draw(st.integers(2, 5)), len(machine.axes)
    reach = np.array([REACH[c] for c in machine.letters])
    low, high = np.maximum(machine.low, -reach), np.minimum(machine.high, reach)
    share = draw(arrays(float, (n, k), elements=st.floats(0, 1)))
    linear = [not a.is_rotary for a in machine.axes]
    for row in range(1, n):
        still = draw(st.sampled_from([None, None, True, False]))
        if still is not None:
            share[row, [c == still for c in linear]] = share[row - 1, [c == still for c in linear]]
    time = draw(arrays(float, n, elements=st.floats(0.5, 60.0)))
    time[0] = 0.0
    return machine, Motion(
        letters=machine.letters,
        positions=low + share * (high - low),
        feed=draw(arrays(float, n, elements=st.floats(0.1, 100.0))),
        time=time,
        kind=draw(arrays(np.int64, n, elements=st.sampled_from(list(MoveKind)))),
        source=np.arange(1, n + 1),
    )


def written(path: Path, program: Program) -> Path:
    file = path.with_suffix(program.suffix)
    file.write_text(program.text, encoding="ascii")
    return file


def ends_of_blocks(again: Motion) -> Array:
    """Rows at which blocks end: moves of the tip are cut into parts when they are read."""
    return np.append(np.flatnonzero(np.diff(again.source)), len(again) - 1)


def uncertainty(again: Motion, motion: Motion, control: str, coordinates: Coordinates) -> Array:
    """What half a step of F is of it, move by move, and 2e-6 for significant digits."""
    kind = DIALECTS[control].modes[coordinates].feed
    decimals = DIALECTS[control].feed[kind].decimals
    feed = 60.0 / motion.time[1:] if kind == "inverse_time" else again.feed[1:] * 60.0
    return 2e-6 + (0.0 if decimals is None else 0.55 * 10.0**-decimals) / feed


def require_same_places(
    again: Motion, motion: Motion, machine: Machine, control: str, *, tips: bool, signed: bool = False
) -> None:
    """Hold places to the decimals that are printed: half a step, or three where a short way is left out.

    Where a word's sign is the direction, there is no −0: 0 is read a step beside itself.
    """
    number = DIALECTS[control].number
    rotary = machine.rotary_columns
    step, shown = 10.0**-number.rotary, machine.shown(motion.positions)[:, rotary]
    off = np.abs(machine.shown(again.positions)[:, rotary] - shown)
    zero = signed & (np.abs(np.remainder(shown + 180.0, 360.0) - 180.0) <= 0.51 * step)
    assert (off <= 1e-7 * np.abs(shown) + np.where(zero, 1.01, 0.51) * step).all()
    if tips:
        places, wanted = tool_poses(machine, again.positions)[0], tool_poses(machine, motion.positions)[0]
    else:
        places, wanted = (m.positions[:, machine.linear_columns] for m in (again, motion))
    # In tip mode the tip is where its words say for the rounded angles.
    np.testing.assert_allclose(places, wanted, atol=3.0 * 10.0**-number.linear)


def require_rapid_times(
    times: Array, at_ends: Motion, machine: Machine, rapid: BoolArray, *, tips: bool
) -> None:
    """Hold rapid moves to the time of their slowest axis; where the tip is led, axes may go farther."""
    moves = np.abs(np.diff(at_ends.positions, axis=0))[rapid]
    needed = np.max(moves / rapid_speeds(machine, np.full(len(moves), RAPID)), axis=1, initial=0.0)
    assert (times >= needed * (1.0 - 1e-9)).all()
    if not tips:
        np.testing.assert_allclose(times, needed, rtol=1e-9)


@pytest.mark.parametrize(("control", "coordinates"), BY_ANGLE)
@FEW
@given(case=motions())
def test_a_program_of_angles_is_read_as_its_motion(tmp_path: Path, case, control, coordinates):
    machine, motion = case
    program = compose_program(motion, machine=machine, control=control, coordinates=coordinates)
    if program.dropped:
        return
    again = read_program(written(tmp_path / "part", program), machine, rapid=60.0 * RAPID)
    ends = ends_of_blocks(again)[-len(motion) :]
    assert len(ends) == len(motion)
    at_ends = replace(
        again,
        **{name: getattr(again, name)[ends] for name in ("positions", "feed", "time", "kind", "source")},
    )
    require_same_places(at_ends, motion, machine, control, tips=coordinates == "tip")
    rapid, spent = motion.rapid[1:], np.diff(np.cumsum(again.time)[ends])
    np.testing.assert_array_equal(at_ends.rapid[1:], rapid)
    require_rapid_times(spent[rapid], at_ends, machine, rapid, tips=coordinates == "tip")
    if any(f.code == "feed-floor" for f in program.findings):
        return
    error = np.abs(spent / motion.time[1:] - 1.0)
    np.testing.assert_array_less(error[~rapid], uncertainty(at_ends, motion, control, coordinates)[~rapid])


# Controls by the way in which they count turns, unwound ones above; machines with an axis of endless turns.
WOUND = [(n, c, w) for n, c in BY_ANGLE for w in DIALECTS[n].windings if w != "unwound"]
WOUND = [case for case in WOUND if "switchkins" not in case[0]]
ENDLESS = ["dmu50ev", "dmu80p-duoblock", "hayashi-640123", "umc-750", "variaxis-630"]


@st.composite
def turning_motions(draw: st.DrawFn) -> tuple[Machine, Motion]:
    """Cuts and links in which the endless axis turns on and on, back, and a whole turn at once."""
    machine = load_machine(draw(st.sampled_from(ENDLESS)))
    n = draw(st.integers(2, 6))
    reach = np.array([REACH[c] for c in machine.letters])
    low, high = np.maximum(machine.low, -reach), np.minimum(machine.high, reach)
    shares = draw(arrays(float, (n, len(machine.axes)), elements=st.floats(0, 1)))
    positions = low + shares * (high - low)
    # LinuxCNC raises speeds to 0.1 deg/min, and rows are found by their times.
    free = st.floats(-500.0, 500.0).filter(lambda angle: abs(angle) > 0.01)
    turn = st.one_of(free, st.sampled_from([0.0, 360.0, -360.0, 180.0, 90.0]))
    steps = draw(st.lists(turn, min_size=n, max_size=n))
    positions[:, machine.column("C")] = np.radians(np.cumsum(steps))
    return machine, Motion(
        letters=machine.letters,
        positions=positions,
        feed=np.full(n, 10.0),
        time=np.append(0.0, np.full(n - 1, 2.0)),
        kind=draw(arrays(np.int64, n, elements=st.sampled_from([MoveKind.CUT, MoveKind.LINK]))),
        source=np.arange(1, n + 1),
    )


@pytest.mark.parametrize(("control", "coordinates", "winding"), WOUND)
@FEW
@given(case=turning_motions())
def test_a_program_that_counts_turns_its_way_is_read_as_its_motion(
    tmp_path: Path, case, control, coordinates, winding
):
    machine, motion = case
    program = compose_program(
        motion, machine=machine, control=control, coordinates=coordinates, winding=winding
    )
    if program.dropped:
        return
    again = read_program(written(tmp_path / "part", program), machine)
    # Parts of long turns are blocks of their own: rows are found again by the time that is left after them.
    left, wanted = (np.cumsum(m.time[::-1])[::-1] - m.time for m in (again, motion))
    rows = np.abs(left[None] - wanted[:, None]).argmin(axis=1)
    c = machine.column("C")
    # On which turn the axis begins isn't in words from 0 to 360.
    turns = np.rint((motion.positions[0, c] - again.positions[rows[0], c]) / (2.0 * np.pi))
    assert turns == 0.0 or winding == "modulo"
    at_ends = replace(
        again,
        positions=again.positions[rows] + 2.0 * np.pi * turns * (np.arange(len(machine.axes)) == c),
        **{name: getattr(again, name)[rows] for name in ("feed", "time", "kind", "source")},
    )
    modulo = DIALECTS[control].modulo
    signed = winding == "modulo" and modulo is not None and modulo.way == "signed"
    require_same_places(at_ends, motion, machine, control, tips=coordinates == "tip", signed=signed)


@pytest.mark.parametrize(("control", "coordinates"), BY_VECTOR)
@FEW
@given(case=motions())
def test_a_program_of_directions_is_read_as_its_path(tmp_path: Path, case, control, coordinates):
    machine, motion = case
    tips, axes = tool_poses(machine, motion.positions)
    turns = np.degrees(np.linalg.norm(np.diff(axes, axis=0), axis=1)) / motion.time[1:] * 60.0
    stands = np.linalg.norm(np.diff(tips, axis=0), axis=1) < 1e-3
    slowest = turns[stands & ~motion.rapid[1:]].min(initial=np.inf)

    def compose():
        return compose_program(motion, machine=machine, control=control, coordinates=coordinates)

    if slowest < 1e-2:  # deg/min: near the least F, which turns the tool where its tip stands
        try:
            program = compose()
        except ToolpathError:
            return
    else:
        program = compose()
    if program.dropped:
        return
    path = read_toolpath(written(tmp_path / "part", program), tool=Tool.ball(6), machine=machine)
    number = DIALECTS[control].number
    np.testing.assert_allclose(path.tips(path.axis)[-len(motion) :], tips, atol=3.0 * 10.0**-number.linear)
    np.testing.assert_array_equal(path.rapid[-len(motion) :][1:], motion.rapid[1:])
    # The first location's direction is that of the angles which the approach turns to.
    got = path.axis[-len(motion) :]
    np.testing.assert_allclose(got, axes, atol=2.0 * 10.0**-number.direction + 2e-6)


texts = st.one_of(st.text(max_size=8), st.sampled_from(["flood", "G55", "1", "Z XY AC", "mist"]))
numbers = st.integers(-5, 20_000)
SETTINGS = {
    **dict.fromkeys(("coolant", "work_offset", "name", "home"), texts),
    **dict.fromkeys(("tool_number", "length_offset", "number", "line_numbers"), numbers),
    **dict.fromkeys(("spindle_rpm", "retract"), st.floats()),
    "unit": st.sampled_from(["mm", "inch"]),
}
MOTION = Motion("XYZAC", np.eye(5) / 2.0, np.ones(5), np.ones(5), np.zeros(5, int), np.arange(5))


@settings(max_examples=150)
@given(
    data=st.data(),
    control=st.sampled_from(sorted(DIALECTS)),
    coordinates=st.sampled_from([None, "axes", "tip", "vector"]),
    winding=st.sampled_from(["unwound", "unwound", "modulo", "rezero"]),
    names=st.lists(st.sampled_from(sorted(SETTINGS)), max_size=2, unique=True),
)
def test_whatever_is_asked_gives_a_program_or_one_message(data, control, coordinates, winding, names):
    asked = {name: data.draw(SETTINGS[name]) for name in names}
    machine, program, message = load_machine("hayashi-640123"), None, "one line"
    try:
        around = ProgramSettings(**asked)
        program = compose_program(
            MOTION,
            machine=machine,
            control=control,
            coordinates=coordinates,
            winding=winding,
            settings=around,
        )
    except FiveAxisError as fault:
        message = str(fault)
    assert len(message.splitlines()) == 1
    if program is not None:
        assert program.text.isascii()
        assert max(map(len, program.lines)) <= DIALECTS[control].longest
        assert not any("\n" in line for line in program.lines)


@pytest.mark.parametrize(("control", "coordinates"), BY_ANGLE + BY_VECTOR)
@settings(max_examples=5)
@given(case=motions(), unit=st.sampled_from(["mm", "inch"]), step=st.sampled_from([None, 1, 10]))
def test_the_same_motion_gives_the_same_bytes_that_every_control_can_read(
    case, control, coordinates, unit, step
):
    machine, motion = case
    dialect = DIALECTS[control]
    around = ProgramSettings(
        unit=unit if unit in dialect.unit else "mm", line_numbers=step if dialect.line_number else None
    )
    made = [
        compose_program(motion, machine=machine, control=control, coordinates=coordinates, settings=around)
        for _ in range(2)
    ]
    assert made[0].text == made[1].text
    assert made[0].text.isascii()
    assert max(map(len, made[0].lines)) <= dialect.longest
    moves = [line for line in made[0].lines if line[:1] not in "(;$#%"]
    assert not any("e-" in line or "e+" in line or "-0.0000 " in line for line in moves)
