"""Laws of reading programs: written again they are the same, arcs keep to circles, nonsense is an error."""

import contextlib
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import PATH_TOLERANCE, Machine, Motion, MoveKind, load_machine
from fiveaxis.nc import ProgramSettings, read_program
from fiveaxis.nc import compose_program as compose_with_way_out

# A way out of the last cut has tests of its own: here the last block is the last move.
compose_program = partial(compose_with_way_out, settings=ProgramSettings(way_out=False))

# Both signs of A, B and C, every place of the rotary axes, and none.
MACHINES = [
    "hayashi-640123",
    "linuxcnc-bridgemill",
    "linuxcnc-max5",
    "linuxcnc-xyzac-trt",
    "linuxcnc-xyzbc-trt",
    "pocketnc-v2",
    "takisawa-mac-v3",
]
REACH = {"X": 500.0, "Y": 500.0, "Z": 500.0, "A": 4.0, "B": 4.0, "C": 700.0}
# Programs of every control are held to their motions in test_programs_of_controls.
BY_AXES = ["linuxcnc", "linuxcnc-switchkins"]
MILL = Machine.from_code("0123")
# mm/min, of axes in rapid moves whose highest speed the machine doesn't tell.
RAPID = 6000.0


@pytest.fixture
def path(tmp_path):
    return tmp_path / "part.ngc"


@st.composite
def motions(draw: st.DrawFn) -> tuple[Machine, Motion]:
    machine = load_machine(draw(st.sampled_from(MACHINES)))
    n, k = draw(st.integers(1, 6)), len(machine.axes)
    reach = np.array([REACH[c] for c in machine.letters])
    low, high = np.maximum(machine.low, -reach), np.minimum(machine.high, reach)
    time = draw(arrays(float, n, elements=st.floats(1e-4, 1e4)))
    time[0] = 0.0
    motion = Motion(
        letters=machine.letters,
        positions=low + draw(arrays(float, (n, k), elements=st.floats(0, 1))) * (high - low),
        feed=draw(arrays(float, n, elements=st.floats(0.01, 1e3))),
        time=time,
        kind=draw(arrays(np.int64, n, elements=st.sampled_from(list(MoveKind)))),
        source=np.arange(1, n + 1),
    )
    return machine, motion


@given(case=motions(), control=st.sampled_from(BY_AXES))
def test_a_motion_that_was_read_is_written_as_the_same_program(path: Path, case, control: str):
    machine, motion = case
    program = compose_program(motion, machine=machine, control=control)
    assume(any(line.startswith("G1") for line in program.lines))
    # Blocks that the control runs faster than their F are read with the time that it takes.
    assume(all(finding.code != "feed-floor" for finding in program.findings))
    path.write_text(program.text, encoding="utf-8")
    read = read_program(path, machine, rapid=RAPID)
    again = compose_program(read, machine=machine, control=control)
    assert again.text == program.text


angles = st.floats(-np.pi, np.pi)


@given(
    radius=st.floats(0.01, 1e4),
    start=angles,
    sweep=st.floats(0.01, 2 * np.pi - 0.01),
    clockwise=st.booleans(),
    plane=st.sampled_from(["G17", "G18", "G19"]),
    by_radius=st.booleans(),
)
@example(radius=10.0, start=0.0, sweep=np.pi, clockwise=True, plane="G17", by_radius=True)
def test_an_arc_stays_on_its_circle_and_turns_as_told(
    path: Path, radius, start, sweep, clockwise, plane, by_radius
):
    first, second = {"G17": "XY", "G18": "ZX", "G19": "YZ"}[plane]
    turn = -sweep if clockwise else sweep
    begin = np.round(radius * np.array([np.cos(start), np.sin(start)]), 9)
    end = np.round(radius * np.array([np.cos(start + turn), np.sin(start + turn)]), 9)
    # By its radius an arc near half a turn isn't determined to the tolerance, whatever the reader does.
    assume(not by_radius or abs(sweep - np.pi) > 0.01 or sweep == np.pi)
    signed = radius if sweep <= np.pi else -radius
    offset = {"X": "I", "Y": "J", "Z": "K"}
    centre = f"{offset[first]}{-begin[0]:.9f} {offset[second]}{-begin[1]:.9f}"
    path.write_text(
        f"{plane} G21 G0 {first}{begin[0]:.9f} {second}{begin[1]:.9f}\n"
        f"{'G2' if clockwise else 'G3'} {first}{end[0]:.9f} {second}{end[1]:.9f} "
        f"{f'R{signed:.9f}' if by_radius else centre} F60000\n",
        encoding="utf-8",
    )
    motion = read_program(path, MILL, start=dict.fromkeys("XYZ", 0.0), rapid=1.0)
    points = motion.positions[1:, ["XYZ".index(first), "XYZ".index(second)]]
    angle = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    steps = np.diff(angle) * (-1 if clockwise else 1)
    assert (steps > 0).all()
    assert steps.sum() == pytest.approx(sweep, abs=1e-5)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), radius, atol=1e-4)
    assert (radius * (1 - np.cos(steps / 2)) <= PATH_TOLERANCE * (1 + 1e-6)).all()
    assert motion.time[2:].sum() == pytest.approx(radius * sweep / 1000.0, rel=1e-5)


@given(
    steps=st.lists(st.tuples(st.sampled_from("XYZ"), st.integers(-10_000, 10_000)), min_size=1, max_size=8)
)
def test_increments_and_positions_say_the_same(path: Path, steps):
    place = dict.fromkeys("XYZ", 0)
    absolute, relative = ["G21 G90 G1 F1000"], ["G21 G91 G1 F1000"]
    for letter, step in steps:
        place[letter] += step
        absolute.append(f"{letter}{place[letter] / 1000:.3f}")
        relative.append(f"{letter}{step / 1000:.3f}")
    assume(any(step for _, step in steps))
    read = []
    for lines in (absolute, relative):
        path.write_text("\n".join(lines), encoding="utf-8")
        read.append(read_program(path, MILL, start=dict.fromkeys("XYZ", 0.0)))
    np.testing.assert_allclose(read[0].positions[-1], read[1].positions[-1], atol=1e-9)
    assert read[0].time.sum() == pytest.approx(read[1].time.sum())


number = st.one_of(
    st.floats(-100, 100).map(lambda x: f"{x:.4f}"),
    st.sampled_from(
        ["0", "1", "-1.", ".5", "+7", "1e9", "9" * 30, "-", "", " ", "x", "1_0", "٣", "0x1", "nan"]
    ),
)
word = st.one_of(
    st.builds("{}{}".format, st.sampled_from("XYZACBIJKRFSPGMNO"), number),
    st.sampled_from("G0 G1 G2 G3 G4 G17 G18 G19 G20 G21 G28 G53 G54 G80 G90 G91 G93 G94 G95 M2 M3".split()),  # noqa: SIM905
    st.sampled_from(["(", ")", "(a)", ";", "/", "%", "#1", "[1]", "X=1", "O<a>", "\u017f1", ""]),
)
block = st.lists(word, max_size=6).map(" ".join)


@settings(max_examples=200)
@given(lines=st.lists(block, max_size=8), known=st.booleans())
@example(lines=["G0 X1", "G2 X2 I.5 J" + "9" * 30 + " F1"], known=True)
@example(lines=["G93 G1 X1 F" + "9" * 30], known=True)
def test_no_program_crashes_the_reader(path: Path, lines: list[str], known: bool):
    machine = load_machine("hayashi-640123")
    path.write_text("\n".join(lines), encoding="utf-8")
    start = dict.fromkeys(machine.letters, 0.0) if known else None
    with contextlib.suppress(ToolpathError):
        motion = read_program(path, machine, start=start, rapid=1000)
        assert np.isfinite(motion.positions).all()
        assert np.isfinite(motion.time).all()
        assert (motion.time[1:] >= 0.0).all()
        assert motion.time[0] == 0.0
        assert (motion.feed > 0.0).all()
        assert (np.diff(motion.source) >= 0).all()
