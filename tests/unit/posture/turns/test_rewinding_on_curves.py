"""Where an axis rewinds within a cut along a curve, the path stays on the curve that it was on."""

from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.model import Limits, MoveKind, Toolpath, parse_tool


def ring(tool: str, n: int = 60, rings: int = 2) -> Toolpath:
    """Rings on a cone, whose chords are up to 35 µm inside its circles."""
    turn = 2.0 * np.pi * np.arange(n + 1) / n
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n + 1)])
    up = np.array([0.0, 0.0, 1.0])
    contact = np.vstack([(20.0 + 3.0 * k) * out + 3.0 * k * up for k in range(rings)])
    return Toolpath.from_contacts(
        contact, np.tile(out + up, (rings, 1)), parse_tool(tool), feed_mm_min=1000.0
    )


@pytest.mark.parametrize("tool", [pytest.param("ball:8", marks=pytest.mark.slow), "bull:8:1.5"])
def test_a_program_with_a_rewind_within_a_curved_cut_is_verified(hayashi, tool):
    axes = (
        replace(a, limits=Limits(-np.radians(200.0), np.radians(200.0))) if a.letter == "C" else a
        for a in hayashi.axes
    )
    machine = replace(hayashi, axes=tuple(axes))
    found = fx.optimise(ring(tool), machine, tilt=(5, 22), effort="quick")
    path = found.toolpath
    assert (path.kind == MoveKind.LINK).any()
    assert not (path.kind[~path.inserted] == MoveKind.LINK).any()
    assert path.curved.any()
    assert found.program().ok
