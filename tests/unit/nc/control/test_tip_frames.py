"""The frame of tip positions, told from the path."""

import numpy as np
import pytest

from fiveaxis.model import Machine, Tool, tool_poses
from fiveaxis.nc import read_program, read_toolpath
from fiveaxis.nc.control.tip_frames import unevenness

MACHINE = Machine.from_code("640123")


def wave():
    """Tips, mm, and C, deg, along a wave in steps of 0.5 mm; C follows its direction."""
    x = np.arange(0.0, 40.0, 0.5)
    tips = np.column_stack([x, 6.0 * np.sin(x / 8.0), np.full_like(x, 5.0)])
    return tips, np.degrees(np.arctan2(0.75 * np.cos(x / 8.0), 1.0)) * 2.0


def ring():
    """A ring of 0.1 mm waves about the table's axis: fixed to the machine, its tips stay near one point."""
    c = np.arange(0.0, 360.0, 3.0)
    angle, radius = np.radians(c), 40.0 + 0.1 * np.sin(np.radians(20.0 * c))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full_like(c, 5.0)]), c


def in_machine(tips, c):
    """Positions that the table's turn by C leaves in the machine: the part's X, Y turned back by C."""
    cos, sin = np.cos(np.radians(c)), np.sin(np.radians(c))
    return np.column_stack(
        [cos * tips[:, 0] + sin * tips[:, 1], cos * tips[:, 1] - sin * tips[:, 0], tips[:, 2]]
    )


@pytest.fixture
def write(tmp_path):
    def write_words(tips, c, on="G43.4 H1"):
        words = [f"X{x:.4f} Y{y:.4f} Z{z:.4f} A0 C{a:.4f}" for (x, y, z), a in zip(tips, c, strict=True)]
        file = tmp_path / "part.nc"
        file.write_text("\n".join(["G21 G90 G94", on, f"G0 {words[0]}", "G1 F600", *words[1:], "M30\n"]))
        return file

    return write_words


def told(findings):
    return {f.code: f.message for f in findings if f.code.startswith("positions")}


@pytest.mark.parametrize("path", [wave, ring])
@pytest.mark.parametrize("frame", ["table", "machine"])
def test_a_fanuc_program_is_read_in_the_frame_in_which_its_path_is_even(write, path, frame):
    tips, c = path()
    file = write(tips if frame == "table" else in_machine(tips, c), c)
    found = read_toolpath(file, tool=Tool.ball(6), machine=MACHINE)
    np.testing.assert_allclose(found.tips(found.axis), tips, atol=2e-4)
    [(code, message)] = told(found.findings).items()
    assert code == "positions-assumed"
    assert message.startswith(
        f"tip positions are read in the frame of the {frame}: over the {len(c) - 1} cuts"
    )
    length = np.linalg.norm(np.diff(tips, axis=0), axis=1).sum()
    assert f"{length:.4g}"[:4] in message
    motion = read_program(file, MACHINE, rapid=5000)
    ends = np.append(np.flatnonzero(np.diff(motion.source)), len(motion) - 1)
    np.testing.assert_allclose(tool_poses(MACHINE, motion.positions[ends])[0], tips, atol=2e-4)
    assert told(motion.findings)[code] == message


def test_the_callers_frame_holds_and_a_contradiction_is_told(write):
    tips, c = wave()
    file = write(in_machine(tips, c), c)
    asked = read_toolpath(file, tool=Tool.ball(6), machine=MACHINE, positions="machine")
    assert told(asked.findings) == {}
    wrong = read_toolpath(file, tool=Tool.ball(6), machine=MACHINE, positions="table")
    assert list(told(wrong.findings)) == ["positions-doubtful"]
    assert told(wrong.findings)["positions-doubtful"].endswith(
        "set positions=machine (--positions) if that is meant"
    )
    moved = wrong.tips(wrong.axis) - tips
    assert np.abs(moved).max() > 1.0


def test_controls_whose_tips_turn_with_the_table_are_read_so(write):
    tips, c = wave()
    found = read_toolpath(write(in_machine(tips, c), c, on="M428"), tool=Tool.ball(6), machine=MACHINE)
    assert list(told(found.findings)) == ["positions-doubtful"]
    found = read_toolpath(write(tips, c, on="M428"), tool=Tool.ball(6), machine=MACHINE)
    assert told(found.findings) == {}


def test_unevenness_is_relative_to_the_steps():
    moves = np.ones(9, dtype=bool)
    line = np.outer(np.arange(10.0), [1.0, 2.0, 0.0])
    assert unevenness(line, moves) == unevenness(100.0 * line, moves) == (pytest.approx(1e-6), 8)
    zigzag = line + np.outer(np.arange(10) % 2, [0.0, 0.0, 1.0])
    assert unevenness(zigzag, moves)[0] > 100.0 * unevenness(line, moves)[0]
    assert unevenness(0.0 * line, moves) == (np.inf, 8)
