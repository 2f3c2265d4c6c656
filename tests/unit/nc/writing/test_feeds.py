"""F where it has few digits left."""

from __future__ import annotations

import numpy as np
import pytest

from fiveaxis.kinematics import linear_positions
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.nc import compose_program, read_program

OPEN = Machine.from_code("640123")


def creeping(way: float, seconds: float) -> Motion:
    """The tip goes `way` mm while C turns a quarter."""
    turned = np.array([[0.0, 0.0], [0.0, np.pi / 2.0]])
    places = linear_positions(OPEN, np.array([[10.0, 0.0, 0.0], [10.0 + way, 0.0, 0.0]]), turned)
    time, feed = np.array([0.0, seconds]), np.full(2, 10.0)
    return Motion("XYZAC", np.asarray(places), feed, time, np.zeros(2, int), np.arange(2))


@pytest.mark.parametrize("control", ["fanuc", "haas", "sinumerik", "heidenhain"])
def test_a_feed_that_its_decimals_change_is_said_with_what_it_does_to_the_time(control, tmp_path):
    program = compose_program(creeping(0.0008, 60.0), machine=OPEN, control=control, coordinates="tip")
    found = [f for f in program.findings if f.code == "feed-rounded"]
    assert [(f.value, f.place.location) for f in found] == [(1.0, 1)]
    assert "F0.0008 is written as 0.001: 48 s for 60 s" in found[0].message
    path = tmp_path / f"p{program.suffix}"
    path.write_text(program.text)
    # Beside the ways in and out.
    assert read_program(path, OPEN).time.sum() == pytest.approx(48.0 + 2 * 0.5, abs=0.01)


@pytest.mark.parametrize(("control", "way"), [("fanuc", 0.2), ("linuxcnc", 0.0008)])
def test_a_feed_with_digits_enough_is_written_without_a_word(control, way):
    program = compose_program(creeping(way, 60.0), machine=OPEN, control=control, coordinates="tip")
    assert not any(f.code == "feed-rounded" for f in program.findings)
