"""F with few significant digits."""

from __future__ import annotations

import numpy as np
import pytest

from fiveaxis.kinematics import linear_positions
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
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
