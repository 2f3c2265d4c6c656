"""Laws of writing: read again, a program is the given motion."""

import re
from functools import partial
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.base import Array
from fiveaxis.model import Machine, Motion, MoveKind, load_machine
from fiveaxis.nc import ProgramSettings, write_motion
from fiveaxis.nc import compose_program as compose_with_lead_out
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source

# The lead-out has its own tests: here the last block is the last move.
compose_program = partial(compose_with_lead_out, settings=ProgramSettings(way_out=False))

MACHINES = ["hayashi-640123", "linuxcnc-xyzac-trt"]
WORD = re.compile(r"([A-Z])(-?\d+(?:\.\d+)?)")


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    n = draw(st.integers(1, 6))
    # Inside the travel of both machines.
    low, high = np.array([[-200, -100, -120, -0.8, -600], [200, 100, 120, 0.5, 600]])
    positions = low + draw(arrays(float, (n, 5), elements=st.floats(0, 1))) * (high - low)
    time = draw(arrays(float, n, elements=st.floats(1e-4, 1e4)))
    time[0] = 0.0
    return Motion(
        letters="XYZAC",
        positions=positions,
        feed=draw(arrays(float, n, elements=st.floats(0.01, 1e3))),
        time=time,
        kind=draw(arrays(np.int64, n, elements=st.sampled_from(list(MoveKind)))),
        source=draw(arrays(np.int64, n, elements=st.integers(1, 10**9))),
    )


def run(text: str, machine: Machine) -> tuple[Array, Array]:
    """Run a program as a control would: modal words, G0 and G1, F as inverse time after G93.

    Returns the axis values after every block from G93 on, (m, k) in mm and rad, tool relative to workpiece,
    and the durations, (m,) s, NaN of rapid moves. The state before the first such block leads, with 0.
    """
    state, mode, inverse = dict.fromkeys(machine.letters, 0.0), None, False
    rows, times = [], [0.0]
    for line in text.splitlines():
        block = re.sub(r"\([^()]*\)", "", line)
        assert WORD.sub("", block).strip() == "", f"not understood: {line}"
        words = WORD.findall(block)
        codes = {float(v) for w, v in words if w == "G"}
        mode = next((m for m in (0.0, 1.0) if m in codes), mode)
        inverse = (inverse or 93.0 in codes) and 94.0 not in codes
        targets = {w: float(v) for w, v in words if w in machine.letters}
        assert inverse or not (targets and mode == 1.0), f"a feed move outside G93: {line}"
        if targets and inverse:
            assert ("F" in dict(words)) is (mode == 1.0), f"F in a rapid move, or none at feed: {line}"
            rows.append(list(state.values()))
            times.append(60.0 / float(dict(words).get("F", "nan")))
        state |= targets
    rows.append(list(state.values()))
    signs = [-1.0 if a.reversed else 1.0 for a in machine.axes]
    scale = [np.pi / 180 if a.is_rotary else 1.0 for a in machine.axes]
    return np.array(rows) * signs * scale, np.array(times)


@given(motion=motions(), name=st.sampled_from(MACHINES))
def test_a_program_read_again_is_the_motion(motion: Motion, name: str):
    machine = load_machine(name)
    program = compose_program(motion, machine=machine)
    rows, times = run(program.text, machine)
    # A first cut has its approach before it, and moves of nothing aren't there.
    started = len(rows) + program.dropped - len(motion)
    assert started in (0, 1)
    moved = np.abs(np.diff(motion.positions, axis=0)).max(axis=1, initial=0.0)
    if program.dropped == 0:
        wanted = motion.positions
        np.testing.assert_allclose(rows[started:, :3], wanted[:, :3], atol=5.1e-7)
        np.testing.assert_allclose(rows[started:, 3:], wanted[:, 3:], atol=np.radians(5.1e-7))
        wanted = np.where(motion.rapid, np.nan, motion.time)[1:]
        np.testing.assert_allclose(times[started + 1 :], wanted, rtol=1e-6)
    else:
        assert (moved < 2e-6).sum() >= program.dropped


@given(motion=motions(), name=st.sampled_from(MACHINES))
def test_a_motion_table_read_again_is_the_motion(motion: Motion, name: str, tmp_path_factory):
    machine = load_machine(name)
    path: Path = write_motion(motion, tmp_path_factory.mktemp("table") / "motion.csv", machine)
    again = read_motion(load_source(path), machine)
    assert again.letters == motion.letters
    np.testing.assert_allclose(machine.shown(again.positions), machine.shown(motion.positions), atol=6e-10)
    np.testing.assert_allclose(again.feed * 60, motion.feed * 60, atol=6e-10)
    np.testing.assert_allclose(again.time, motion.time, atol=6e-10)
    np.testing.assert_array_equal(again.source, motion.source)


@settings(max_examples=200)
@given(name=st.text(max_size=40), value=st.text(max_size=400))
def test_no_header_can_break_out_of_its_comment(name: str, value: str):
    machine = load_machine("hayashi-640123")
    motion = Motion(
        "XYZAC", np.eye(5) / 2.0, np.ones(5), np.ones(5), np.zeros(5, dtype=np.int64), np.arange(5)
    )
    bare = compose_program(motion, machine=machine)
    program = compose_program(motion, machine=machine, header={name: value})
    comments = [line for line in program.lines if line.startswith("(")]
    assert [line for line in program.lines if line not in comments] == [
        line for line in bare.lines if not line.startswith("(")
    ]
    for line in comments:
        assert re.fullmatch(r"\([ -'*-~]*\)", line)
        assert len(line) < 120
