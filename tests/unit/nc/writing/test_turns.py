"""Windings: the control's reading of the words is the given motion."""

import math
import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Limits, Machine, Motion, MoveKind, load_machine
from fiveaxis.nc import DIALECTS, ProgramSettings
from fiveaxis.nc import compose_program as compose_with_lead_out
from fiveaxis.nc.writing.table_parts import Modulo
from fiveaxis.nc.writing.turns import within_a_turn

# The lead-out has its own tests: here the last block is the last move.
compose_program = partial(compose_with_lead_out, settings=ProgramSettings(way_out=False))

WORD = re.compile(r"([A-Z])(-?\d+(?:\.\d+)?)")
SHORTER = DIALECTS["linuxcnc"].model_copy(
    update={"name": "shorter", "modulo": Modulo(way="shorter"), "reset": None, "winding_notes": {}}
)
C_TOLERANCE = 2e-6  # deg: half a unit of the last decimal at both ends, and the place beside zero


def motion_of(c_deg, kinds=None, times=None) -> Motion:
    """A motion along X in which C takes given angles."""
    n = len(c_deg)
    positions = np.zeros((n, 5))
    positions[:, 0], positions[:, 4] = np.arange(n), np.radians(c_deg)
    return Motion(
        letters="XYZAC",
        positions=positions,
        feed=np.full(n, 10.0),
        time=np.array([0.0] + [1.0] * (n - 1)) if times is None else np.asarray(times, dtype=float),
        kind=np.zeros(n, dtype=np.int64) if kinds is None else np.asarray(kinds),
        source=np.arange(1, n + 1),
    )


def unwrapped(word: str, current: float) -> float:
    """The angle to which LinuxCNC turns a wrapped rotary axis: in the direction of the word's sign."""
    value = float(word)
    backwards = math.copysign(1.0, value) < 0.0
    assert -360.0 < value < 360.0
    place = abs(value) + 360.0 * math.floor(current / 360.0)
    if backwards:
        return place - 360.0 if place > current else place
    return place + 360.0 if place < current else place


def run(text: str, rule: str, start: float) -> np.ndarray:
    """C after each timed block, deg, and the block's duration, (m, 2), as a control counts it.

    `start` says on which turn the axis stands when the first timed block comes.
    """
    current, offset, timed, rows = start, 0.0, False, []
    for line in text.splitlines():
        block = re.sub(r"\([^()]*\)", "", line)
        words = dict(WORD.findall(block))
        if "G92.1" in block.split():
            offset = 0.0
        elif block.startswith("G92 "):
            offset = current - float(words["C"])
        elif block.startswith("G93"):
            timed = True
        elif timed and block.startswith("G1"):
            if "C" in words:
                value = float(words["C"])
                if rule == "signed":
                    current = unwrapped(words["C"], current)
                elif rule == "shorter":
                    assert 0.0 <= value < 360.0
                    current += math.remainder(value - current, 360.0)
                else:
                    current = value + offset
            rows.append((current, 60.0 / float(words["F"])))
    return np.array(rows)


ANGLES = st.lists(
    st.one_of(st.floats(-900.0, 900.0), st.sampled_from([0.0, 360.0, -360.0, 180.0, 359.9999999, 1e-7])),
    min_size=2,
    max_size=6,
)


@pytest.mark.parametrize("rule", ["signed", "shorter", "rezero", "unwound"])
@given(angles=ANGLES, links=st.lists(st.sampled_from([0, 1]), min_size=6, max_size=6))
def test_a_control_turns_the_axis_as_the_motion_does(rule, angles, links):
    machine = load_machine("hayashi-640123")
    winding = "modulo" if rule in ("signed", "shorter") else rule
    motion = motion_of(angles, kinds=[MoveKind.RAPID, *links[: len(angles) - 1]])
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(DIALECTS, "shorter", SHORTER)
        control = "shorter" if rule == "shorter" else "linuxcnc"
        program = compose_program(motion, machine=machine, control=control, winding=winding)
    turn = angles[0] if winding != "modulo" else float(within_a_turn(np.array(angles[0]), 6))
    rows = run(program.text, rule, turn)
    # Parts of a move sum to it; the last one of each ends where the move does.
    assert rows[:, 1].sum() == pytest.approx(motion.time.sum(), rel=1e-5)
    ends = np.cumsum(rows[:, 1])
    reached = rows[np.searchsorted(ends, np.arange(1, len(angles)) - 1e-3), 0]
    np.testing.assert_allclose(reached - turn, np.array(angles[1:]) - angles[0], atol=len(rows) * C_TOLERANCE)
    if winding == "modulo":
        assert np.abs(np.diff(rows[:, 0], prepend=turn)).max() < 180.0


def test_a_counted_axis_is_reset_where_a_link_begins(hayashi):
    kinds = [MoveKind.RAPID, 0, 0, MoveKind.LINK, 0, MoveKind.LINK, 0]
    motion = motion_of([0, 300, 800, 900, 1000, 1100, 1200], kinds=kinds)
    text = compose_program(motion, machine=hayashi, winding="rezero").text
    assert re.findall(r"^G92 .*$", text, re.M) == ["G92 C80.000000"]
    assert re.findall(r" C(-?[\d.]+) F", text) == [
        "300.000000",
        "800.000000",
        "180.000000",
        "280.000000",
        "380.000000",
        "480.000000",
    ]
    blocks = [line for line in text.splitlines() if not line.startswith("(")]
    assert blocks.count("G92.1") == 2
    assert blocks.index("G92.1") < blocks.index("G93")


def test_an_axis_that_stands_still_has_no_signed_word(hayashi):
    motion = motion_of([350.0, 350.0, 370.0, 350.0], kinds=[MoveKind.RAPID, 0, 0, 0])
    lines = compose_program(motion, machine=hayashi, winding="modulo").lines
    moves = [line.split(" F")[0] for line in lines if line.startswith("G1 ")]
    assert moves == [
        "G1 X1.000000 Y0.000000 Z0.000000 A0.000000",
        "G1 X2.000000 Y0.000000 Z0.000000 A0.000000 C10.000000",
        "G1 X3.000000 Y0.000000 Z0.000000 A0.000000 C-350.000000",
    ]


def test_the_header_says_what_the_control_needs(hayashi):
    text = compose_program(motion_of([0.0, 10.0]), machine=hayashi, winding="modulo").text
    assert "WRAPPED_ROTARY" in text
    assert "WRAPPED_ROTARY" not in compose_program(motion_of([0.0, 10.0]), machine=hayashi).text


def limited(machine: Machine, degrees: float) -> Machine:
    limits = Limits(-np.radians(degrees), np.radians(degrees))
    return replace(
        machine, axes=tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    )


def test_turns_of_an_axis_with_limits_are_not_thrown_away(hayashi):
    motion = motion_of([0.0, 10.0])
    with pytest.raises(SettingError, match="C of 'hayashi-640123' goes from -400 to 400 deg"):
        compose_program(motion, machine=limited(hayashi, 400.0), winding="modulo")
    # One turn and no more has nothing to count.
    program = compose_program(motion, machine=limited(hayashi, 180.0), winding="modulo")
    assert any(" C10.000000" in line for line in program.lines)


def test_a_winding_that_a_control_lacks_is_refused(monkeypatch, hayashi):
    monkeypatch.setitem(DIALECTS, "shorter", SHORTER)
    motion = motion_of([0.0, 10.0])
    with pytest.raises(SettingError, match="'shorter' has no winding 'rezero'; it knows unwound, modulo"):
        compose_program(motion, machine=hayashi, control="shorter", winding="rezero")
    with pytest.raises(SettingError, match="unknown winding 'short'; known: unwound, modulo, rezero"):
        compose_program(motion, machine=hayashi, winding="short")
