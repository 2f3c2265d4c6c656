"""F: modal along a pass, and with few significant digits."""

import re

import numpy as np
import pytest

from fiveaxis.model import Machine, Motion, MoveKind, linear_positions
from fiveaxis.nc import compose_program, read_program

OPEN = Machine.from_code("640123")


def creeping(length: float, seconds: float) -> Motion:
    """The tip moves by `length` mm while C turns a quarter."""
    turned = np.array([[0.0, 0.0], [0.0, np.pi / 2.0]])
    positions = linear_positions(OPEN, np.array([[10.0, 0.0, 0.0], [10.0 + length, 0.0, 0.0]]), turned)
    time, feed = np.array([0.0, seconds]), np.full(2, 10.0)
    return Motion("XYZAC", np.asarray(positions), feed, time, np.zeros(2, int), np.arange(2))


@pytest.mark.parametrize("control", ["fanuc", "haas", "sinumerik", "heidenhain"])
def test_a_feed_changed_by_its_decimals_is_reported_with_the_change_of_time(control, tmp_path):
    program = compose_program(creeping(0.0008, 60.0), machine=OPEN, control=control, coordinates="tip")
    found = [f for f in program.findings if f.code == "feed-rounded"]
    assert [(f.value, f.place.location) for f in found] == [(1.0, 1)]
    assert "F0.0008 is written as 0.001: 48 s for 60 s" in found[0].message
    path = tmp_path / f"p{program.suffix}"
    path.write_text(program.text)
    # Besides lead-in and lead-out.
    assert read_program(path, OPEN, rapid=1e7).time.sum() == pytest.approx(48.0 + 2 * 0.5, abs=0.01)


@pytest.mark.parametrize(("control", "length"), [("fanuc", 0.2), ("linuxcnc", 0.0008)])
def test_a_feed_with_enough_digits_has_no_finding(control, length):
    program = compose_program(creeping(length, 60.0), machine=OPEN, control=control, coordinates="tip")
    assert not any(f.code == "feed-rounded" for f in program.findings)


CUT, LINK, RAPID = MoveKind.CUT, MoveKind.LINK, MoveKind.RAPID
# Control, coordinates, and what stands in every block that states F.
MODAL = [
    ("fanuc", "tip", " F600.000"),
    ("haas", "tip", " F600.000"),
    ("sinumerik", "vector", " F600.000"),
    ("linuxcnc", "tip", " F600"),
    ("heidenhain", "tip", " R0 F600.000"),
    ("heidenhain", "vector", " R0 F600.000"),
]


def passes(kind: list[MoveKind], slow: int | None = None) -> Motion:
    """The tip moves 3 mm a block at 600 mm/min while C turns; one of the blocks takes twice as long."""
    n = len(kind)
    turned = np.column_stack([np.full(n, 0.5), np.linspace(0.0, 0.3, n)])
    tips = np.column_stack([np.arange(n) * 3.0 + 1.0 / 3.0, np.full(n, 20.0), np.zeros(n)])
    positions = linear_positions(OPEN, tips, turned)
    time = np.append(0.0, np.full(n - 1, 0.3))
    if slow is not None:
        time[slow] *= 2.0
    return Motion("XYZAC", np.asarray(positions), np.full(n, 10.0), time, np.array(kind), np.arange(n))


def stated(motion: Motion, control: str, coordinates: str) -> list[tuple[int, str]]:
    """Row and text of every F on the path."""
    program = compose_program(motion, machine=OPEN, control=control, coordinates=coordinates)
    first = next(row for row, line in zip(program.rows, program.lines, strict=True) if " F6" in line)
    return [
        (row - first, line[re.search(r"( R0)? F[\d.]+", line).start() :])
        for row, line in zip(program.rows, program.lines, strict=True)
        if re.search(r" F\d", line)
    ]


@pytest.mark.parametrize(("control", "coordinates", "text"), MODAL)
def test_a_pass_of_one_feed_states_it_once_and_every_pass_begins_with_it(
    control, coordinates, text, tmp_path
):
    motion = passes([CUT] * 6 + [LINK] * 2 + [CUT] * 4 + [RAPID] + [CUT] * 3)
    # Lead-in, the first pass, the link, the second and the third pass, lead-out.
    rows = [0, 1, 6, 8, 13, 16]
    assert stated(motion, control, coordinates) == [(row, text) for row in rows]
    program = compose_program(motion, machine=OPEN, control=control, coordinates=coordinates)
    path = tmp_path / f"p{program.suffix}"
    path.write_text(program.text)
    if coordinates == "tip":
        read = read_program(path, OPEN, rapid=1e7)
        assert read.time.sum() == pytest.approx(14 * 0.3 + 2 * 0.5, abs=0.01)


def test_a_block_that_an_axis_slows_has_its_own_feed_and_the_next_one_that_of_the_path():
    texts = [text for _, text in stated(passes([CUT] * 6, slow=3), "fanuc", "tip")]
    assert texts == [" F600.000", " F600.000", " F300.000", " F600.000", " F600.000"]


def test_the_inverse_of_a_duration_stands_in_every_block():
    program = compose_program(passes([CUT] * 6), machine=OPEN, control="fanuc", coordinates="axes")
    assert sum(line.endswith(" F200.000") for line in program.lines) == 5


def test_f_of_a_turn_on_the_spot_counts_the_degrees_between_two_directions():
    turned = np.array([[0.0, 0.2], [0.0, 0.3]])
    positions = linear_positions(OPEN, np.tile([10.0, 0.0, 0.0], (2, 1)), turned)
    still = np.zeros(2, int)
    motion = Motion(
        "XYZAC", np.asarray(positions), np.full(2, 10.0), np.array([0.0, 60.0]), still, np.arange(2)
    )
    text = compose_program(motion, machine=OPEN, control="sinumerik", coordinates="vector").text
    assert float(re.findall(r" F([0-9.]+)", text)[1]) == pytest.approx(np.degrees(0.1), abs=1e-3)
