"""What effort, a start, a wider range and another telling of the same problem do to the result."""

from itertools import pairwise

import pytest
from support.sampled_surfaces import SHAPES, backwards, denser, sampled, turned

import fiveaxis as fx
from fiveaxis.model import Filling, follow, motion_energy

TILT = (15, 70)
# Rounding of what is compared.
SAME = 1.0 + 1e-9
# Share by which equivalent problems may differ.
SCATTER = 0.015


def passes(name: str, count: int = 40) -> fx.Toolpath:
    return sampled(SHAPES[name], count, rings=2)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["blade", "bowl", "saddle"])
def test_more_effort_never_costs_more(hayashi, name):
    efforts = ("quick", "normal", "thorough") if name == "saddle" else ("quick", "normal")
    asked = {"tilt": TILT, "bound": False}
    costs = [fx.optimise(passes(name, 24), hayashi, effort=e, **asked).energy.total for e in efforts]
    assert all(more <= less * SAME for less, more in pairwise(costs)), costs


@pytest.mark.slow
@pytest.mark.parametrize("name", ["blade", "bowl"])
def test_more_effort_never_takes_longer(name):
    machine, asked = fx.load_machine("linuxcnc-xyzac-trt"), {"tilt": TILT, "objective": "time"}
    quick, normal = (fx.optimise(passes(name, 24), machine, effort=e, **asked) for e in ("quick", "normal"))
    assert normal.energy.time <= quick.energy.time * SAME


@pytest.mark.slow
def test_each_objective_is_least_where_it_is_asked_for(hayashi):
    energy, travel = (
        fx.optimise(passes("flutes"), hayashi, tilt=TILT, objective=o).energy for o in ("energy", "travel")
    )
    assert energy.total <= travel.total * SAME
    assert travel.travel <= energy.travel * SAME


@pytest.mark.slow
def test_a_better_start_is_not_thrown_away(hayashi):
    path, bounds = passes("wave"), {"tilt": TILT, "steady": 0.0}
    good = fx.optimise(path, hayashi, **bounds)
    start = good.motion.positions[~good.toolpath.inserted][:, hayashi.rotary_columns]
    given = motion_energy(hayashi, Filling().blocks(path, hayashi, follow(path, hayashi, start)))
    found = fx.optimise(path, hayashi, effort="quick", start=start, **bounds)
    assert found.energy.total <= given.total * SAME


@pytest.mark.slow
def test_a_wider_range_is_not_worse(hayashi):
    ranges = (20, 60), (15, 70)
    narrow, wide = (fx.optimise(passes("flutes"), hayashi, tilt=t, steady=0.0).energy.total for t in ranges)
    assert wide <= 1.005 * narrow


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["cone", "torus", "wave", "blade", "saddle", "flutes"])
def test_the_same_problem_told_another_way_costs_the_same(shape, hayashi):
    """How far apart it is on all shapes tests/benchmarks/scatter.py measures."""
    path = passes(shape)
    ways = {"turned": (turned(path, 200.0), hayashi)} | {f"{n}x": (denser(path, n), hayashi) for n in (2, 4)}
    ways |= {"as given": (path, hayashi), "backwards": backwards(path, hayashi)}
    costs = {way: fx.optimise(p, m, tilt=TILT, effort="quick").energy.total for way, (p, m) in ways.items()}
    assert max(costs.values()) <= (1.0 + SCATTER) * min(costs.values()), costs
