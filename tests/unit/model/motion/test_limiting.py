"""What limits the speed: shares add up, and planted causes are found by name, on every kind of clock."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import Clock, Motion, load_machine, predicted_time
from fiveaxis.model.motion.run_time import ControlTiming
from fiveaxis.nc import DIALECTS

TRUNNION = load_machine("linuxcnc-xyzac-trt")
LINUXCNC = {name: DIALECTS[name] for name in DIALECTS if isinstance(DIALECTS[name].corners, str)}
CLOCKS = [None, *LINUXCNC.values()]
EXACT = DIALECTS["linuxcnc"].model_copy(update={"corners": "exact-path"})


def motion_of(rows, feed: float = 10.0) -> Motion:
    """Rows of X, Y, Z, A, C at a feed along X, Y, Z, or rad/s where these stand."""
    positions = np.asarray(rows, dtype=float)
    moves = np.diff(positions, axis=0, prepend=positions[:1])
    along, turn = np.linalg.norm(moves[:, :3], axis=1), np.linalg.norm(moves[:, 3:], axis=1)
    n = len(positions)
    time = np.where(along > 0.0, along / feed, turn)
    return Motion("XYZAC", positions, np.full(n, feed), time, np.zeros(n, int), np.arange(n))


def wave(n: int = 300) -> np.ndarray:
    u = np.linspace(0.0, 6.0 * np.pi, n)
    return np.stack([10 * u, 20 * np.sin(u), 0 * u, 0.3 * np.sin(2 * u), 0.5 * u], axis=1)


def by_cause(motion: Motion, machine=TRUNNION, dialect: ControlTiming | None = None) -> dict[str, float]:
    taken = predicted_time(motion, machine, dialect)
    found = taken.limiting.by_cause
    assert sum(found.values()) == pytest.approx(taken.total, rel=1e-9)
    np.testing.assert_allclose(taken.limiting.times, taken.times, atol=1e-9)
    return found


def slow_in(letter: str, factor: float = 0.05):
    axes = (replace(a, max_speed=a.max_speed * factor) if a.letter == letter else a for a in TRUNNION.axes)
    return replace(TRUNNION, axes=tuple(axes))


@pytest.mark.parametrize("dialect", CLOCKS, ids=lambda d: getattr(d, "name", "none"))
@pytest.mark.parametrize("feed", [2.0, 20.0, 200.0])
def test_the_shares_add_up_to_the_run_time(dialect, feed):
    assert by_cause(motion_of(wave(), feed), TRUNNION, dialect)


@pytest.mark.parametrize("dialect", CLOCKS, ids=lambda d: getattr(d, "name", "none"))
def test_a_slow_rotary_axis_takes_the_time_by_name(dialect):
    line = np.zeros((50, 5))
    line[:, 0], line[:, 4] = np.linspace(0.0, 100.0, 50), np.linspace(0.0, 2.0, 50)
    # Blocks that turn an axis are passed at speed by a control that rounds; one that stops in each is slow.
    coarse = line[[0, -1]]
    found = by_cause(motion_of(coarse), slow_in("C"), dialect)
    assert next(iter(found)) == "C speed"
    assert found["C speed"] > 0.95 * sum(found.values())


def test_planted_exact_stops_take_their_ramps():
    """A line in pieces that each end at rest: of each the ramps, v / A for the two, are stops."""
    rows = np.zeros((11, 5))
    rows[:, 0], rows[:, 4] = np.linspace(0.0, 100.0, 11), np.linspace(0.0, 1e-3, 11)
    found = by_cause(motion_of(rows), TRUNNION, EXACT)
    # Both ramps of 10 blocks from 10 mm/s at 300 mm/s².
    assert found["stops"] == pytest.approx(10 * 2 * 10.0 / 300.0, rel=0.1)
    assert found["feed"] == pytest.approx(10.0 - 10 * 10.0 / 300.0, rel=0.02)
    whole = by_cause(motion_of(rows[[0, -1]]), TRUNNION, EXACT)
    assert whole["stops"] == pytest.approx(found["stops"] / 10.0, rel=0.1)


def test_a_line_that_turns_back_stops_there_on_a_control_that_rounds():
    rows = np.zeros((3, 5))
    rows[1, 0] = 50.0
    found = by_cause(motion_of(rows))
    assert set(found) == {"feed", "stops"}
    # Twice from rest to rest.
    assert found["stops"] == pytest.approx(4 * 10.0 / 300.0, rel=0.01)


def test_a_circle_beyond_its_centripetal_acceleration_is_limited_by_that():
    u = np.linspace(0.0, 20.0 * np.pi, 7201)
    rows = np.stack([0.1 * np.cos(u), 0.1 * np.sin(u), *[0 * u] * 3], axis=1)
    found = by_cause(motion_of(rows, 20.0))
    assert found["X acceleration"] + found["Y acceleration"] > 0.8 * sum(found.values())


@pytest.mark.parametrize("letter", ["X", "C"])
def test_without_accelerations_an_axis_at_its_speed_is_named_and_the_rest_is_feed(letter):
    bare = slow_in(letter)
    bare = replace(bare, axes=tuple(replace(a, max_acceleration=None) for a in bare.axes))
    rows = np.zeros((3, 5))
    rows[1:, 1] = [10.0, 20.0]
    rows[2, bare.column(letter)] = 1.0
    motion = motion_of(rows)
    lasting = 1.0 / bare.axes[bare.column(letter)].max_speed
    motion = replace(motion, time=np.array([0.0, 1.0, lasting]))
    assert by_cause(motion, bare) == pytest.approx({f"{letter} speed": lasting, "feed": 1.0})
    assert Clock().is_programmed(bare)
