"""A user's mask: satisfied everywhere, queried seldom, and an error if nothing satisfies it."""

import numpy as np
import pytest
from support.ring_path import ring
from support.travel_optimiser import optimise

from fiveaxis.base.errors import Infeasible, SettingError
from fiveaxis.model import load_machine, tool_axes

# The edge of a mask is found by queries; a path along it costs at most this share more than along a bound.
DEARER = 0.02
# Postures queried at a location.
MOST_QUERIES = 8_000


class Counted:
    """A mask that counts its queries."""

    def __init__(self, function):
        self.function, self.queried, self.rows = function, 0, []

    def __call__(self, rows, rotary):
        assert rotary.shape == (len(rows), 2)
        self.queried += len(rows)
        self.rows.append(rows)
        return self.function(rows, rotary)


def rotary_of(solution, motion=None):
    """Rotary angles at the given locations, (n, 2) rad."""
    motion = motion or solution.motion
    return motion.positions[~solution.toolpath.inserted][:, solution.machine.rotary_columns]


def in_band(rows, rotary):
    """Forbid C from 60 to 100 deg at the locations 20…49; C comes first in the chain."""
    c = np.degrees(np.mod(rotary[:, 0], 2.0 * np.pi))
    return ~((rows >= 20) & (rows < 50) & (c > 60.0) & (c < 100.0))


@pytest.fixture(scope="module")
def free(hayashi):
    """The ring where nothing is refused."""
    return optimise(ring(), hayashi, tilt=(15, 75))


@pytest.fixture(scope="module")
def banded(hayashi):
    """The ring with the forbidden band, and its mask."""
    mask = Counted(in_band)
    return optimise(ring(), hayashi, tilt=(15, 75), mask=mask), mask


def leaning(path, low, high):
    machine = load_machine("hayashi-640123")

    def mask(rows, rotary):
        cosine = np.sum(tool_axes(machine, rotary) * path.normal[rows], axis=1)
        return (cosine <= np.cos(np.radians(low))) & (cosine >= np.cos(np.radians(high)))

    return mask


def test_a_forbidden_band_of_c_is_avoided_with_few_queries(hayashi, free, banded):
    solution, mask = banded
    assert not in_band(np.arange(80), rotary_of(free)).all()
    assert in_band(np.arange(80), rotary_of(solution)).all()
    assert max(solution.residuals().values()) <= 1e-9
    turns = np.degrees(np.abs(solution.motion.moves[:, hayashi.rotary_columns]))
    assert turns.max() <= 15.0 + 1e-6
    assert mask.queried < MOST_QUERIES * 80
    assert solution.energy.travel >= free.energy.travel * (1.0 - 1e-3)


def test_a_baseline_that_would_have_to_jump_across_the_band_is_missing_with_the_reason(hayashi, banded):
    solution, _ = banded
    for name in ("normal", "lead-lean"):
        assert name not in solution.baselines
        assert "turns too far" in solution.missing[name]
    for baseline in solution.compared.values():
        assert in_band(np.arange(80), rotary_of(solution, baseline.motion)).all()


def test_a_mask_that_is_a_bound_gives_what_the_bound_gives(hayashi):
    path = ring()
    bound = optimise(path, hayashi, tilt=(15, 50), effort="normal")
    masked = optimise(path, hayashi, tilt=(15, 75), effort="normal", mask=leaning(path, 15, 50))
    assert masked.energy.travel <= bound.energy.travel * (1.0 + DEARER)
    assert leaning(path, 15, 50)(np.arange(80), rotary_of(masked)).all()


def test_a_mask_that_admits_everything_changes_nothing(hayashi, free):
    solution = optimise(ring(), hayashi, tilt=(15, 75), mask=lambda rows, _: np.ones(len(rows), dtype=bool))
    assert solution.energy.travel == pytest.approx(free.energy.travel, rel=DEARER)


def test_a_mask_that_refuses_everything_lists_every_location(hayashi):
    path = ring(20)
    with pytest.raises(Infeasible, match="20 of 20 locations have no posture in sequence that the mask") as c:
        optimise(path, hayashi, tilt=(15, 75), max_turn=60.0, mask=lambda rows, _: np.zeros(len(rows), bool))
    assert [f.place.location for f in c.value.findings] == list(range(20))
    assert "the mask refuses each of the" in c.value.findings[0].message


@pytest.mark.slow
def test_where_a_mask_refuses_a_narrow_tilt_range_it_is_named_and_not_the_largest_turn():
    """The range is narrower than the steps of the samples, which have no posture at some locations."""
    machine = load_machine("linuxcnc-bridgemill").with_tool_length(60.0).with_setup((0.0, 0.0, -200.0))
    path, mask = ring(20), lambda rows, _: np.zeros(len(rows), bool)
    with pytest.raises(Infeasible, match="20 of 20 locations have no posture in sequence that the mask") as c:
        optimise(path, machine, tilt=(44.9, 45.1), max_turn=60.0, mask=mask)
    assert [f.place.location for f in c.value.findings] == list(range(20))
    assert all("the mask refuses each of the admissible postures" in f.message for f in c.value.findings)


def test_a_mask_that_refuses_one_location_names_it(hayashi):
    with pytest.raises(Infeasible) as caught:
        optimise(ring(20), hayashi, tilt=(15, 75), max_turn=60.0, mask=lambda rows, _: rows != 7)
    assert [f.place.location for f in caught.value.findings] == [7]


def test_the_mask_is_enforced_at_a_single_location_too(hayashi):
    path = ring().at(np.array([3]))
    free = optimise(path, hayashi, tilt=(15, 75))
    mask = leaning(path, 40, 60)
    lean = free.tilt.angles(tool_axes(hayashi, rotary_of(free)))
    assert not 40.0 < np.degrees(lean[0]) < 60.0
    assert mask(np.arange(1), rotary_of(optimise(path, hayashi, tilt=(15, 75), mask=mask))).all()


@pytest.mark.parametrize("answer", [lambda rows, _: True, lambda rows, _: np.ones(len(rows))])
def test_an_answer_that_isnt_a_truth_value_for_each_posture_is_refused(hayashi, answer):
    with pytest.raises(SettingError, match="of bool is needed"):
        optimise(ring(20), hayashi, tilt=(15, 75), max_turn=60.0, mask=answer)
