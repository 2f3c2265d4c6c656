"""Laws of writing: read again, a table is the given motion; a header stays a comment."""

import re
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.model import Motion, MoveKind, load_machine
from fiveaxis.nc import compose_program, write_motion
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source

MACHINES = ["hayashi-640123", "linuxcnc-xyzac-trt"]


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
