"""Infeasible paths: which locations, which bound, and which change would help."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds
from support.travel_optimiser import optimise

from fiveaxis.base.errors import Infeasible
from fiveaxis.model import Limits, Tool, Toolpath
from fiveaxis.posture.strategy.infeasibility import unreachable


def wall(n: int, n_z: np.ndarray | float, turns: float = 0.25) -> Toolpath:
    """Contacts round a cylinder whose normals rise or fall by their Z component."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, n)
    rise = np.broadcast_to(n_z, n)
    flat = np.sqrt(1.0 - rise**2)
    normal = np.stack([flat * np.cos(angle), flat * np.sin(angle), rise], axis=1)
    contact = np.stack([20 * np.cos(angle), 20 * np.sin(angle), np.full(n, 10.0)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6), name="wall.csv")


def with_limits(machine, **limits):
    axes = tuple(replace(a, limits=limits.get(a.letter, a.limits)) for a in machine.axes)
    return replace(machine, axes=axes)


def falling(n: int, rows, degrees: float) -> Toolpath:
    """A wall with normals so many degrees below the horizontal at some locations."""
    n_z = np.full(n, 0.2)
    n_z[rows] = -np.sin(np.radians(degrees))
    return wall(n, n_z)


def test_infeasible_locations_are_listed_with_the_changes_that_would_help(hayashi):
    # 70 deg below the horizontal is 160 deg from the vertical: A −120 deg needs a tilt of 40.
    path = falling(30, slice(12, 15), 70.0)
    with pytest.raises(Infeasible, match="3 of 30 locations have no admissible posture") as caught:
        optimise(path, hayashi, tilt=(5, 30))
    findings = caught.value.findings
    assert [f.place.location for f in findings] == [12, 13, 14]
    for finding in findings:
        assert finding.code == "no-posture"
        assert 40.0 <= number_after(finding.message, "tilt up to ") <= 40.5
        assert -130.2 <= number_after(finding.message, "A to ") <= -130.0
        assert finding.value == pytest.approx(10.0, abs=0.1)


def number_after(message: str, before: str) -> float:
    """Read the number that follows some words."""
    return float(message.split(before)[1].split()[0])


def test_the_recommended_changes_help(hayashi):
    path = falling(9, slice(3, 6), 70.0)
    with pytest.raises(Infeasible) as caught:
        optimise(path, hayashi, tilt=(5, 30), max_turn=360.0)
    messages = [f.message for f in caught.value.findings]
    tilt = max(number_after(m, "tilt up to ") for m in messages)
    lowest = min(number_after(m, "A to ") for m in messages)
    assert unreachable(path, hayashi, tilt_bounds(path, (5, tilt))) == []
    limits = Limits(np.radians(lowest), hayashi.axis("A").limits.high)
    assert unreachable(path, with_limits(hayashi, A=limits), tilt_bounds(path, (5, 30))) == []
    # And a little less of either doesn't.
    assert unreachable(path, hayashi, tilt_bounds(path, (5, tilt - 2.0)))
    limits = Limits(np.radians(lowest + 1.0), hayashi.axis("A").limits.high)
    assert unreachable(path, with_limits(hayashi, A=limits), tilt_bounds(path, (5, 30)))


def test_all_of_a_path_may_be_infeasible(hayashi):
    with pytest.raises(Infeasible, match="20 of 20 locations") as caught:
        optimise(wall(20, -0.95), hayashi, tilt=(5, 20))
    assert [f.place.location for f in caught.value.findings] == list(range(20))


def test_a_linear_axis_that_is_too_short_is_named(hayashi):
    machine = with_limits(hayashi, Z=Limits(-1000.0, -20.0))
    with pytest.raises(Infeasible) as caught:
        optimise(wall(5, 0.9), machine, tilt=(0, 10))
    assert "Z to" in caught.value.findings[0].message
    assert caught.value.findings[0].message.count(" mm") >= 1


def test_an_impossible_lead_is_named_with_the_bounds_that_could_be_left_out(hayashi):
    path = falling(8, slice(0, 8), 50.0)
    with pytest.raises(Infeasible) as caught:
        optimise(path, hayashi, tilt=(0, 60), lead=(-5, 5), lean=(-60, -20))
    assert "leaving out lean <= -20 deg" in caught.value.findings[0].message


def test_a_turn_that_is_too_large_is_named_with_the_bound_that_would_do(hayashi):
    path = wall(12, -0.3, turns=0.92)
    with pytest.raises(Infeasible, match="no sequence of postures leads along the path") as caught:
        optimise(path, hayashi, tilt=(15, 40), max_turn=15.0)
    findings = caught.value.findings
    needed = max(number_after(f.message, "--max-turn ") for f in findings)
    for finding in findings:
        assert f"from location {finding.place.location - 1} C has to turn" in finding.message
        assert "and 15 deg are allowed" in finding.message
        assert finding.value > 15.0
    assert optimise(path, hayashi, tilt=(15, 40), max_turn=needed).residuals()["tilt"] <= 1e-9


def test_only_the_corner_is_named_where_the_rest_of_a_path_can_be_followed(hayashi):
    angle = np.concatenate([np.linspace(0.0, 0.3, 10), np.linspace(2.3, 2.6, 10)])
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(20, -0.3)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6), name="corner")
    with pytest.raises(Infeasible) as caught:
        optimise(path, hayashi, tilt=(15, 40), max_turn=12.0)
    named = [f.place.location for f in caught.value.findings]
    assert 10 in named
    assert len(named) <= 6


def test_a_closed_loop_ends_where_it_began(hayashi):
    path = wall(61, -0.3, turns=1.0)
    solution = optimise(path, hayashi, tilt=(15, 75))
    assert max(solution.residuals().values()) <= 1e-9
    np.testing.assert_allclose(path.pivot[0], path.pivot[-1], atol=1e-9)
    for name, energy in solution.baselines.items():
        assert solution.energy.travel <= energy.total * (1.0 + 1e-9), name
    loops = Toolpath.from_contacts(np.tile(path.contact, (2, 1)), np.tile(path.normal, (2, 1)), path.tool)
    # The second round can cost no more than the first and the return to its start.
    assert optimise(loops, hayashi, tilt=(15, 75)).energy.travel <= 2.3 * solution.energy.travel + 1.0


@pytest.mark.parametrize("bounds", [{"tilt": (15, 75)}, {"tilt": (15, 75), "plane": (0.0, 0.0, 1.0)}])
def test_one_location_and_the_same_twice_have_a_posture(hayashi, bounds):
    path = wall(9, -0.3)
    assert len(optimise(path.at(np.array([4])), hayashi, **bounds).motion) == 1
    twice = optimise(path.at(np.array([4, 4])), hayashi, **bounds)
    assert twice.energy.travel == pytest.approx(0.0, abs=1e-6)
