"""Starts, reversals and changes of speed, counted by hand and block by block."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.model import Motion, MoveKind, load_machine
from fiveaxis.model.motion.steadiness import measure_steadiness

HAYASHI = load_machine("hayashi-640123")
STANDING, STANDING_TURN = 1e-3, 2e-5  # mm/s and rad/s


def motion(moves, time=None, kind=None, **columns):
    """A motion of XYZAC by its moves, (b, 5) mm and rad, after a first row without one."""
    moves = np.vstack([np.zeros(5), moves])
    n = len(moves)
    time = np.ones(n - 1) if time is None else np.asarray(time, dtype=float)
    kind = np.full(n, MoveKind.CUT) if kind is None else np.array([kind[0], *kind])
    return Motion(
        letters="XYZAC",
        positions=np.cumsum(moves, axis=0),
        feed=np.ones(n),
        time=np.append(0.0, time),
        kind=kind,
        source=np.arange(n),
        **columns,
    )


def of_axis(letter, moves, **more):
    columns = np.zeros((len(moves), 5))
    columns[:, "XYZAC".index(letter)] = moves
    return motion(columns, **more)


def counted(blocks, letter, **more):
    found = measure_steadiness(HAYASHI, blocks, **more)
    return found.starts[letter], found.reversals[letter]


@pytest.mark.parametrize("letter", ["X", "C"])
@pytest.mark.parametrize(
    ("moves", "starts", "reversals"),
    [
        ([0, 0, 0], 0, 0),
        ([1, 1, 2], 1, 0),
        ([0, 1, 1], 1, 0),
        ([1, -1, 1], 1, 2),
        ([1, 0, 1], 2, 0),
        ([1, 0, -1], 2, 0),
        ([0, -1, -1, 1, 0, 0, 2, -1], 2, 2),
        ([], 0, 0),
    ],
)
def test_a_start_follows_standing_and_a_reversal_follows_the_other_direction(
    letter, moves, starts, reversals
):
    assert counted(of_axis(letter, moves), letter) == (starts, reversals)


def test_only_the_axes_that_move_are_counted():
    found = measure_steadiness(HAYASHI, of_axis("Y", [1.0, -1.0]))
    assert found.starts == {"X": 0, "Y": 1, "Z": 0, "A": 0, "C": 0}
    assert found.reversals == {"X": 0, "Y": 1, "Z": 0, "A": 0, "C": 0}


def test_an_axis_stands_as_long_as_it_costs_nothing():
    still = np.array([0.9 * STANDING, 0.0, 0.0, 0.9 * STANDING_TURN, 0.0])
    blocks = motion([still, -still, 10.0 * still, still, 10.0 * still])
    found = measure_steadiness(HAYASHI, blocks)
    assert (found.starts["X"], found.starts["A"]) == (2, 2)
    assert sum(found.reversals.values()) == 0
    # As slow, but for ten times as long: the speed decides and not the travel.
    slow = replace(blocks, time=10.0 * blocks.time)
    assert sum(measure_steadiness(HAYASHI, slow).starts.values()) == 0


def test_travel_within_the_rounding_of_the_words_is_none():
    blocks = of_axis("X", [0.5, 0.004, -0.5])
    assert counted(blocks, "X") == (1, 1)
    assert counted(blocks, "X", rounding=0.005) == (2, 0)
    turned = of_axis("C", [0.5, 0.004, -0.5])
    assert counted(turned, "C", rounding=0.005) == (1, 1)


def test_a_block_without_duration_neither_stops_an_axis_nor_starts_it():
    assert counted(of_axis("X", [1, 0, 1], time=[1, 0, 1]), "X") == (1, 0)
    assert counted(of_axis("X", [1, 0, -1], time=[1, 0, 1]), "X") == (1, 1)
    assert counted(of_axis("X", [1, 1], time=[0, 0]), "X") == (0, 0)


def test_rapid_moves_start_and_reverse_axes_too():
    kind = [MoveKind.CUT, MoveKind.RAPID, MoveKind.CUT]
    found = measure_steadiness(HAYASHI, of_axis("Z", [-1, 1, -1], kind=kind))
    assert (found.starts["Z"], found.reversals["Z"]) == (1, 2)
    assert found.changes == {}


def test_each_event_has_its_block_its_axis_and_its_time():
    blocks = motion([[1, 0, 0, 0, 0], [-1, 0, 0, 0, 1], [-1, 0, 0, 0, 1]], time=[2.0, 3.0, 1.0])
    found = measure_steadiness(HAYASHI, blocks)
    events = zip(found.block, found.column, found.reverses, found.time, strict=True)
    assert [tuple(map(float, event)) for event in events] == [(1, 0, 0, 0), (2, 0, 1, 2), (2, 4, 0, 2)]


def test_the_largest_change_of_speed_is_the_one_between_two_cuts():
    cut, link = MoveKind.CUT, MoveKind.LINK
    blocks = of_axis("X", [1, 2, 9, 9, 6], time=[1, 0.5, 1, 1, 1], kind=[cut, cut, link, cut, cut])
    found = measure_steadiness(HAYASHI, blocks).changes
    assert set(found) == {"X"}
    assert (found["X"].size, found["X"].block) == (3.0, 2)


def test_as_plain_data_counts_have_totals_and_rotary_changes_are_in_degrees():
    blocks = motion([[1, 0, 0, 0, 0.1], [-1, 0, 0, 0, 0.2]])
    data = measure_steadiness(HAYASHI, blocks).as_dict()
    assert (data["starts"], data["reversals"]) == (2, 1)
    assert data["starts_by_axis"] == {"X": 1, "Y": 0, "Z": 0, "A": 0, "C": 1}
    assert data["reversals_by_axis"] == {"X": 1, "Y": 0, "Z": 0, "A": 0, "C": 0}
    assert data["speed_changes"]["X"] == {"change": 2.0, "unit": "mm/s", "block": 2}
    assert data["speed_changes"]["C"]["change"] == pytest.approx(np.degrees(0.1))
    assert data["speed_changes"]["C"]["unit"] == "deg/s"


def count_block_by_block(blocks):
    """Count as one would with a pencil: every axis by itself, one block after the other."""
    counts = {letter: [0, 0] for letter in blocks.letters}
    for column, letter in enumerate(blocks.letters):
        least, before = STANDING if letter in "XYZ" else STANDING_TURN, "stands"
        for row in range(1, len(blocks)):
            if blocks.time[row] == 0.0:
                continue
            speed = (blocks.positions[row, column] - blocks.positions[row - 1, column]) / blocks.time[row]
            now = "stands" if abs(speed) < least else "forth" if speed > 0.0 else "back"
            if now != "stands" and now != before:
                counts[letter][before != "stands"] += 1
            before = now
    return counts


MOVES = st.lists(
    st.tuples(*[st.sampled_from([-2.0, -1.0, -1e-9, 0.0, 1e-9, 1.0, 3.0])] * 5, st.sampled_from([0, 0.5, 2])),
    max_size=30,
)


@settings(max_examples=200)
@given(MOVES)
def test_the_counts_are_those_of_going_through_block_by_block(rows):
    table = np.array(rows).reshape(-1, 6)
    blocks = motion(table[:, :5], time=table[:, 5])
    found = measure_steadiness(HAYASHI, blocks)
    counts = {c: [found.starts[c], found.reversals[c]] for c in blocks.letters}
    assert counts == count_block_by_block(blocks)
