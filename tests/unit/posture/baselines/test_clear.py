"""Baselines under a mask: nearest clear postures, and no others changed."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.quick_optimiser import optimise, tilt_bounds

from fiveaxis.model import Tool, Toolpath, load_machine, tool_axes
from fiveaxis.posture.baselines.catalogue import find_baselines
from fiveaxis.posture.baselines.clear import moved_clear
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import Problem

MACHINE = load_machine("hayashi-640123")
N = 60
DEGREE = np.radians(1.0)


def ring() -> Toolpath:
    """Contacts once round a wall, normals leaning downwards."""
    angle = np.linspace(0.0, 2.0 * np.pi, N, endpoint=False)
    flat = np.sqrt(1.0 - 0.3**2)
    normal = np.stack([flat * np.cos(angle), flat * np.sin(angle), np.full(N, -0.3)], axis=1)
    contact = np.stack([25.0 * np.cos(angle), 25.0 * np.sin(angle), np.full(N, 10.0)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6), name="ring")


PATH = ring()
BOUNDS = tilt_bounds(PATH, (15, 75))
PROBLEM = Problem.build(PATH, MACHINE, BOUNDS, max_turn=np.radians(40.0))
COLUMNS = MACHINE.rotary_columns


@cache
def plain():
    return find_baselines(PATH, MACHINE, BOUNDS)[0]


def moved(function):
    return moved_clear(plain(), PROBLEM, PATH, Mask(function))


def angles(baseline) -> np.ndarray:
    return baseline.motion.positions[:, COLUMNS]


def disc(centre: np.ndarray, radius: float):
    """Refuses a disc of rotary angles at one location."""

    def mask(rows, rotary):
        return (rows != 20) | (np.linalg.norm(rotary - centre, axis=1) > radius)

    return mask


@pytest.mark.parametrize("away", [0.0, 2.0, 5.5])
@pytest.mark.parametrize("direction", [0.3, 1.9, 4.0])
def test_out_of_a_disc_the_nearest_posture_is_that_of_brute_force(away, direction):
    here = angles(plain()["normal"])[20]
    centre = here + away * DEGREE * np.array([np.cos(direction), np.sin(direction)])
    mask = disc(centre, 6.0 * DEGREE)
    side = np.arange(-14.0, 14.01, 0.05) * DEGREE
    grid = here + np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    positions, excess = PROBLEM.placed(np.full(len(grid), 20), grid)
    admitted = (excess == 0.0) & (PROBLEM.limit_excess(positions) == 0.0)
    admitted &= mask(np.full(len(grid), 20), grid)
    least = np.linalg.norm(grid - here, axis=1)[admitted].min()
    kept, missing = moved(mask)
    assert "normal" not in missing
    found = np.linalg.norm(angles(kept["normal"])[20] - here)
    assert least - 0.2 * DEGREE <= found <= 1.03 * least + 0.1 * DEGREE
    assert kept["normal"].note.startswith("1 of 60 locations")


def test_beyond_a_half_plane_the_nearest_posture_lies_square_to_its_edge():
    here = angles(plain()["normal"])[20]
    square = np.array([np.cos(1.0), np.sin(1.0)])

    def mask(rows, rotary):
        return (rows != 20) | ((rotary - here) @ square > 3.0 * DEGREE)

    # A wide range, at whose edge no baseline lies.
    wide = tilt_bounds(PATH, (0, 89))
    kept, _ = moved_clear(plain(), replace(PROBLEM, bounds=wide.all), PATH, Mask(mask))
    away = angles(kept["normal"])[20] - here
    assert np.linalg.norm(away) == pytest.approx(3.0 * DEGREE, rel=0.02)
    assert away @ square == pytest.approx(3.0 * DEGREE, rel=0.02)


def test_along_a_wall_the_posture_stays_on_one_side():
    """The obstacle lies in the middle of the path's own angles: both sides are equally near."""
    own = angles(plain()["normal"])

    def mask(rows, rotary):
        off = (rotary - own[rows])[:, 0] + 1e-4 * (-1.0) ** rows
        return (rows < 15) | (rows > 40) | (np.abs(off) > 3.0 * DEGREE)

    kept, _ = moved(mask)
    away = (angles(kept["normal"]) - own)[15:41, 0]
    assert len(set(np.sign(away))) == 1


def test_where_nothing_is_clear_the_baseline_is_missing_with_the_reason():
    kept, missing = moved(lambda rows, rotary: rows != 7)
    assert kept == {}
    assert set(missing) == set(plain())
    assert all("1 of them have no clear posture" in reason for reason in missing.values())
    assert all("first location 7" in reason for reason in missing.values())


def test_what_can_only_turn_too_far_is_missing():
    own = angles(plain()["normal"])
    narrow = Problem.build(PATH, MACHINE, BOUNDS, max_turn=np.radians(8.0))

    def mask(rows, rotary):
        return (rows != 20) | (np.linalg.norm(rotary - own[20], axis=1) > 12.0 * DEGREE)

    only = {"normal": plain()["normal"]}
    kept, missing = moved_clear(only, narrow, PATH, Mask(mask))
    assert kept == {}
    assert "turns too far" in missing["normal"]


caps = st.lists(
    st.tuples(st.integers(0, N - 1), st.integers(1, N), st.floats(-0.3, 0.3), st.floats(0.05, 0.5)),
    min_size=1,
    max_size=3,
)


@settings(max_examples=25)
@given(caps)
def test_a_moved_baseline_is_admitted_everywhere_and_otherwise_unchanged(drawn):
    own = tool_axes(MACHINE, angles(plain()["normal"]))

    def mask(rows, rotary):
        axis, admitted = tool_axes(MACHINE, rotary), np.ones(len(rows), dtype=bool)
        for first, count, north, size in drawn:
            centre = own[min(first + count // 2, N - 1)] + np.array([0.0, north, 0.0])
            near = axis @ (centre / np.linalg.norm(centre)) > np.cos(size)
            admitted &= ~((rows >= first) & (rows < first + count) & near)
        return admitted

    kept, missing = moved(mask)
    assert set(kept) | set(missing) == set(plain())
    for name, baseline in kept.items():
        before, after = angles(plain()[name]), angles(baseline)
        assert mask(np.arange(N), after).all()
        refused = ~mask(np.arange(N), before)
        np.testing.assert_array_equal(after[~refused], before[~refused])
        assert (baseline.note != "") == refused.any()
        positions, excess = PROBLEM.placed(slice(None), after)
        assert excess.max() <= 1e-9
        assert PROBLEM.limit_excess(positions).max() <= 1e-9
        assert np.all(PROBLEM.turn_excess(after) <= PROBLEM.turn_excess(before) + 1e-9)


def test_a_result_under_a_mask_has_baselines(vase, hayashi):
    """The scattered mask of the benchmarks, on a part of the case."""
    path = vase.at(np.arange(300))

    def mask(rows, rotary):
        c, a = rotary.T
        return ~(np.sin(6.0 * c + rows / 40.0) * np.sin(9.0 * a + rows / 90.0) > 0.5)

    found = optimise(path, hayashi, tilt=(15, 75), mask=mask)
    assert found.savings()
    assert any(baseline.note for baseline in found.compared.values())
