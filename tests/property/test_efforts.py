"""What effort, a start, a wider range and another telling of the same problem do to the result."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from shapes import SHAPES, backwards, denser, sampled, turned

import fiveaxis as fx

TILT = (15, 70)
# Rounding of what is compared.
SAME = 1.0 + 1e-9
# Share by which equivalent problems may differ, a guard: `tests/benchmarks/scatter.py` prints by how much.
SCATTER = 0.1


def passes(name: str) -> fx.Toolpath:
    return sampled(SHAPES[name], 40, rings=2)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SHAPES))
def test_more_effort_never_costs_more(hayashi, name):
    efforts = ("quick", "normal", "thorough") if name in ("blade", "saddle") else ("quick", "normal")
    costs = [fx.optimise(passes(name), hayashi, tilt=TILT, effort=e).energy.total for e in efforts]
    assert all(more <= less * SAME for less, more in pairwise(costs)), costs


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wave", "bowl", "flutes"])
def test_no_other_objective_saves_more_energy(hayashi, name):
    found = {o: fx.optimise(passes(name), hayashi, tilt=TILT, objective=o) for o in ("energy", "travel")}
    assert found["energy"].energy.total <= found["travel"].energy.total * SAME


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wave", "saddle", "torus"])
def test_a_better_start_is_not_thrown_away(hayashi, name):
    good = fx.optimise(passes(name), hayashi, tilt=TILT, steady=0.0)
    start = good.motion.positions[~good.toolpath.inserted][:, hayashi.rotary_columns]
    # Without the locations that were inserted, a program of these postures costs what it costs.
    plain = fx.optimise(passes(name), hayashi, tilt=TILT, effort="quick", start=start, steady=0.0)
    quick = fx.optimise(passes(name), hayashi, tilt=TILT, effort="quick", steady=0.0)
    assert plain.energy.total <= quick.energy.total * 1.02


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SHAPES))
def test_the_same_problem_told_another_way_costs_the_same(hayashi, name):
    path = passes(name)
    ways = {f"{angle:g}": (turned(path, angle), hayashi) for angle in (0.0, 37.0, 200.0)}
    ways |= {"2x": (denser(path, 2), hayashi), "backwards": backwards(path, hayashi)}
    costs = {way: fx.optimise(p, m, tilt=TILT).energy.total for way, (p, m) in ways.items()}
    assert max(costs.values()) <= (1.0 + SCATTER) * min(costs.values()), costs
    assert np.isfinite(list(costs.values())).all()
