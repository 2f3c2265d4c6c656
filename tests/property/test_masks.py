"""Whatever a mask refuses: the result is admitted everywhere, sound and no costlier than baselines."""

from functools import cache

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.quick_optimiser import optimise

from fiveaxis.base.errors import Infeasible
from fiveaxis.model import Tool, Toolpath, load_machine, tool_axes

MACHINE = load_machine("hayashi-640123")
N = 30


def ring(n: int = N) -> Toolpath:
    """Contacts once round a lobed wall, normals leaning downwards."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    flat = np.sqrt(1.0 - 0.3**2)
    normal = np.stack([flat * np.cos(angle), flat * np.sin(angle), np.full(n, -0.3)], axis=1)
    r = 20.0 + 3.0 * np.cos(3.0 * angle)
    contact = np.stack([r * np.cos(angle), r * np.sin(angle), np.full(n, 10.0)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6), name="ring")


PATH = ring()
OPTIONS = {"tilt": (15, 75), "max_turn": 40.0, "effort": "quick"}


@cache
def free_axes() -> np.ndarray:
    """Tool axes of the path without a mask: a mask that refuses none of them tests nothing."""
    free = optimise(PATH, MACHINE, **OPTIONS)
    return tool_axes(MACHINE, rotary_of(free, free.motion))


def rotary_of(solution, motion) -> np.ndarray:
    """Rotary angles at the given locations, (n, 2) rad."""
    return motion.positions[~solution.toolpath.inserted][:, MACHINE.rotary_columns]


class Caps:
    """Refuses tool axes near some directions at some locations."""

    def __init__(self, caps: list[tuple[int, int, float, float, float]]) -> None:
        self.caps = caps

    def __call__(self, rows: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        axis, admitted = tool_axes(MACHINE, rotary), np.ones(len(rows), dtype=bool)
        for first, count, east, north, size in self.caps:
            centre = free_axes()[min(first + count // 2, N - 1)] + np.array([east, north, 0.0])
            centre /= np.linalg.norm(centre)
            admitted &= ~((rows >= first) & (rows < first + count) & (axis @ centre > np.cos(size)))
        return admitted


class MappedCaps(Caps):
    """The same with a map of directions of its own."""

    def rough(self, rows: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        return self(rows, np.round(rotary / 0.05) * 0.05)


caps = st.lists(
    st.tuples(
        st.integers(0, N - 1),
        st.integers(1, N),
        st.floats(-0.3, 0.3),
        st.floats(-0.3, 0.3),
        st.floats(0.05, 0.8),
    ),
    min_size=1,
    max_size=4,
)


@settings(max_examples=4)
@given(kind=st.sampled_from([Caps, MappedCaps]), drawn=caps)
@example(kind=MappedCaps, drawn=[(10, 20, 0.1, -0.1, 0.4)])
def test_a_path_is_admitted_everywhere_and_sound(kind, drawn):
    mask = kind(drawn)
    try:
        found = optimise(PATH, MACHINE, **OPTIONS, mask=mask)
    except Infeasible:
        return
    assert mask(np.arange(N), rotary_of(found, found.motion)).all()
    assert max(found.residuals().values()) <= 1e-9
    assert found.problem.violation(found.motion.positions[:, MACHINE.rotary_columns]) <= 1e-9
    for baseline in found.compared.values():
        assert mask(np.arange(N), rotary_of(found, baseline.motion)).all()
        if found.problem.violation(baseline.motion.positions[:, MACHINE.rotary_columns]) <= 1e-9:
            assert found.energy.total <= baseline.energy.total + 1e-6
