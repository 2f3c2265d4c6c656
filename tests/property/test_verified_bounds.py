"""`verify` finds the bounds of `optimise` kept, and others broken where they are."""

from functools import cache

import numpy as np
import pytest
from support.travel_optimiser import optimise

from fiveaxis.check import Tolerances, verify
from fiveaxis.model import Tool, Toolpath


def wavy(n: int = 40) -> Toolpath:
    """A cut over a floor whose normal sways about the vertical, the singular direction."""
    x = np.linspace(0.0, 20.0, n)
    normal = np.stack([0.15 * np.sin(x / 2.0), 0.25 * np.cos(x / 3.0), np.ones(n)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Toolpath.from_contacts(np.stack([x, 5.0 + 0.0 * x, 0.0 * x], axis=1), normal, Tool.ball(6.0))


def ring(n: int = 60) -> Toolpath:
    """Contacts once round a lobed wall that overhangs."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(n, -0.3)], axis=1)
    r = 20.0 + 3.0 * np.cos(3.0 * angle)
    contact = np.stack([r * np.cos(angle), r * np.sin(angle), np.full(n, 10.0)], axis=1)
    return Toolpath.from_contacts(contact, normal / np.hypot(1.0, 0.3), Tool.ball(6.0))


BOUNDS = {
    "hold": (wavy, {"tilt": (0, 60)}, {"hold": {"C": 35.0}}, "held-axis"),
    "max_turn": (ring, {"tilt": (15, 75)}, {"max_turn": 5.0}, "jump"),
    "turn_rate": (ring, {"tilt": (15, 75)}, {"turn_rate": 1.5}, "turn-rate"),
    "lead": (wavy, {"tilt": (0, 60)}, {"lead": (5.0, 15.0)}, "tilt"),
    "lean": (wavy, {"tilt": (0, 60)}, {"lean": (-15.0, -5.0)}, "tilt"),
    "plane": (wavy, {"tilt": (0, 60)}, {"plane": (1.0, 0.3, 0.0)}, "tilt"),
}


@cache
def free_solution(make, machine, *tilt):
    return optimise(make(), machine, tilt=tilt)


@pytest.mark.parametrize("name", BOUNDS)
def test_a_given_bound_is_verified_and_one_that_was_not_given_is_found_broken(hayashi, name):
    make, leaning, bound, code = BOUNDS[name]
    path, free = make(), free_solution(make, hayashi, *leaning["tilt"])
    bound_by_it = optimise(path, hayashi, **leaning, **bound)
    broken = verify(free.motion, hayashi, free.toolpath, **leaning, **bound)
    kept = verify(bound_by_it.motion, hayashi, bound_by_it.toolpath, **leaning, **bound)
    assert set(broken.counts) - {"tip-deviation"} == {code}
    assert set(kept.counts) <= {"tip-deviation"}
    assert len(kept.passed) > len(verify(free.motion, hayashi, free.toolpath).passed)


def test_where_the_optimiser_could_not_hold_c_verification_warns_of_the_same_moves(hayashi):
    """The reference turns round the singular direction within its cone, so C must turn there."""
    n = 60
    angle = np.linspace(0.0, 2.0 * np.pi, n)
    lean = np.radians(3.0)
    axis = np.stack([np.sin(lean) * np.cos(angle), np.sin(lean) * np.sin(angle), np.full(n, np.cos(lean))], 1)
    path = Toolpath.from_tips(np.stack([angle, 0 * angle, 0 * angle], axis=1), axis, Tool.ball(6.0))
    bounds = {"cone": 1.0, "singular_cone": 8.0}
    solution = optimise(path, hayashi, **bounds)
    reported = [f for f in solution.toolpath.findings if f.code == "singular-turn"]
    report = verify(solution.motion, hayashi, solution.toolpath, **bounds)
    assert reported
    assert report.ok
    turned = np.degrees(np.abs(np.diff(solution.motion.positions[:, hayashi.rotary_columns[0]])))
    assert sum(f.value for f in reported) == pytest.approx(turned.sum(), rel=1e-6)
    (found,) = [f for f in report.findings if f.code == "singular-turn"]
    assert [found.place] == [f.place for f in reported]
    assert found.value == pytest.approx(turned[np.radians(turned) > Tolerances().angle].sum(), rel=1e-6)
