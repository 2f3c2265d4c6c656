"""How far machines lean the tool, against a sweep of the second rotary axis."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.kinematics import lean_range, reachable_positions, singular_direction, tool_axes
from fiveaxis.machine import Chain, Limits, Line, Machine, load_machine, machine_names

RNG = np.random.default_rng(12)
FIVE_AXIS = [n for n in machine_names() if len(load_machine(n).rotaries) == 2]


def leans(machine: Machine, second: np.ndarray) -> np.ndarray:
    rotary = np.column_stack([np.zeros_like(second), second])
    return np.arccos(np.clip(tool_axes(machine, rotary) @ singular_direction(machine), -1.0, 1.0))


def limited(machine: Machine, low: float, high: float) -> Machine:
    """Limit the second rotary axis, and no other."""
    limits = {machine.rotaries[1]: Limits(low, high)}
    return replace(
        machine, axes=tuple(replace(a, limits=limits.get(a.letter, Limits())) for a in machine.axes)
    )


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_the_lean_within_limits_is_what_a_sweep_finds(name):
    machine = load_machine(name)
    for low, width in zip(RNG.uniform(-7.0, 7.0, 30), RNG.uniform(0.1, 7.0, 30), strict=True):
        within = limited(machine, low, low + width)
        swept = leans(within, np.linspace(low, low + width, 2001))
        found = lean_range(within)
        np.testing.assert_allclose(found.limited, (swept.min(), swept.max()), atol=5e-3)
        assert found.reach[0] <= found.limited[0] + 1e-12
        assert found.limited[1] <= found.reach[1] + 1e-12


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_where_both_branches_are_within_limits_is_what_the_inverse_finds(name):
    machine, seen = load_machine(name), set()
    for low, width in zip(RNG.uniform(-4.0, 1.0, 30), RNG.uniform(0.5, 6.0, 30), strict=True):
        within = limited(machine, low, low + width)
        both = lean_range(within).both
        second = np.linspace(low, low + width, 60)
        axis = tool_axes(within, np.column_stack([np.zeros_like(second), second]))
        found = reachable_positions(within, np.zeros_like(axis), axis)
        column = within.column(within.rotaries[1])
        for lean, angles in zip(leans(within, second), found[..., column].T, strict=True):
            different = len(np.unique(np.round(np.mod(angles[np.isfinite(angles)], 2.0 * np.pi), 6)))
            if all(abs(lean - end) > 0.02 for ends in both for end in ends):
                assert (different == 2) == any(least < lean < most for least, most in both)
                seen.add(len(both))
    assert {0, 1} <= seen


def test_a_nutating_table_at_45_degrees_leans_up_to_90():
    code = Machine.from_code("650123")
    machine = replace(code, chain=Chain.from_code(code.code, {"B": Line((0.0, 1.0, 1.0))}))
    found = lean_range(machine)
    np.testing.assert_allclose(np.degrees(found.reach), (0.0, 90.0), atol=1e-5)
