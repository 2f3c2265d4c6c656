"""A file of our own is read back as what it is, whatever it is called and whatever its header says."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.base.errors import FiveAxisError
from fiveaxis.model import Motion, Tool, load_machine, tool_poses
from fiveaxis.nc import DIALECTS, compose_program, read_program, read_toolpath, write_motion
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source

MACHINES = ["umc-750", "linuxcnc-xyzac-trt", "dmu80p-duoblock"]
MODES = [(name, mode) for name, dialect in DIALECTS.items() for mode in dialect.modes]
SUFFIXES = [".nc", ".txt", ".h", ".mpf", ".csv", ".apt", ".i", ".xyz", ""]
# Words of languages and of headers, in the name of a part.
NAMES = st.lists(
    st.sampled_from(
        [
            *("Information", "form-shaping", "TRAORI", "BEGIN PGM X MM", "(A5=15", "E1=2)", "MSG(", "%"),
            *("winding: modulo shorter C", "positions: machine", "IF [1]", "x,y,z,i,j,k", "G20 M451"),
            *("GOTO/1,2,3", "UNITS/INCHES", "$$", "# x", "; O1"),
        ]
    ),
    max_size=3,
).map(" ".join)
FEW = settings(max_examples=6)


def motion_on(machine, seed: int) -> Motion:
    """Positions within the travel, on steps that every control's decimals can write."""
    draw = np.random.default_rng(seed)
    low, high = np.maximum(machine.low, -50.0), np.minimum(machine.high, 50.0)
    turns = machine.rotary_columns
    low[turns], high[turns] = np.maximum(machine.low, -1.0)[turns], np.minimum(machine.high, 1.0)[turns]
    n = 12
    return Motion(
        letters=machine.letters,
        positions=low + draw.random((n, len(machine.axes))) * (high - low),
        feed=np.full(n, 10.0),
        time=np.append(0.0, np.full(n - 1, 5.0)),
        kind=np.zeros(n, dtype=np.int64),
        source=np.arange(1, n + 1),
    )


@pytest.mark.parametrize(("control", "mode"), MODES)
@FEW
@given(
    name=NAMES,
    suffix=st.sampled_from(SUFFIXES),
    machine=st.sampled_from(MACHINES).map(load_machine),
    seed=st.integers(0, 99),
)
def test_a_program_is_read_as_its_motion_under_any_suffix(
    tmp_path: Path, control, mode, name, suffix, machine, seed
):
    motion = motion_on(machine, seed)
    header = {"source": name, name.replace(":", " ") or "part": "made for TRANS"}
    program = compose_program(motion, machine=machine, control=control, coordinates=mode, header=header)
    file = tmp_path / f"renamed{suffix}"
    file.write_text(program.text)
    tips, axes = tool_poses(machine, motion.positions)
    path = read_toolpath(file, tool=Tool.ball(6), machine=machine)
    got = path.tips(path.axis)
    near = [np.linalg.norm(got - tip, axis=1).argmin() for tip in tips]
    assert near == sorted(near)
    np.testing.assert_allclose(got[near], tips, atol=2e-3)
    np.testing.assert_allclose(path.axis[near], axes, atol=1e-4)
    if mode != "vector":
        again = read_program(file, machine, rapid=5000.0)
        assert again.name == str(file)
        ends = [np.linalg.norm(tool_poses(machine, again.positions)[0] - tip, axis=1).min() for tip in tips]
        assert max(ends) < 2e-3
    elif DIALECTS[control].language != "blocks":
        with pytest.raises(FiveAxisError, match=r"is a list of cutter locations, .*read_toolpath"):
            read_program(file, machine)


@FEW
@given(suffix=st.sampled_from(SUFFIXES), machine=st.sampled_from(MACHINES).map(load_machine))
def test_the_table_of_a_motion_is_read_under_any_suffix(tmp_path: Path, suffix, machine):
    motion = motion_on(machine, 5)
    file = write_motion(motion, tmp_path / "motion.csv", machine).replace(tmp_path / f"renamed{suffix}")
    np.testing.assert_allclose(read_motion(load_source(file), machine).positions, motion.positions, atol=1e-8)
    path = read_toolpath(file, tool=Tool.ball(6), machine=machine)
    np.testing.assert_allclose(path.tips(path.axis), tool_poses(machine, motion.positions)[0], atol=1e-6)
    with pytest.raises(FiveAxisError, match=r"is the table of a motion, not a program; .*read_toolpath"):
        read_program(file, machine)
