"""The surface at a path's contacts, which stands for the part before the path and after it."""

import numpy as np
import pytest

from fiveaxis.check import surface_at_contacts
from fiveaxis.check.verification.outside import APART, PIECE
from fiveaxis.model import Tool, Toolpath


def straight(step: float) -> Toolpath:
    """A cut of 4 mm along x in even steps, mm."""
    x = np.arange(0.0, 4.0 + step / 2.0, step)
    contact = np.column_stack([x, np.zeros((len(x), 2))])
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (len(x), 1)), Tool.ball(6))


@pytest.mark.parametrize("step", [0.06, 0.5])
def test_each_contact_has_its_piece(step):
    path = straight(step)
    surface = surface_at_contacts(path)
    assert surface is not None
    assert len(surface.faces) == len(path)


def test_of_fine_steps_pieces_stay_that_leave_no_wide_gap():
    path = straight(0.004)
    surface = surface_at_contacts(path)
    assert surface is not None
    assert len(surface.faces) < 0.1 * len(path)
    along = np.sort(np.asarray(surface.vertices)[:, 0])
    assert along[0] <= PIECE
    assert np.diff(along).max() <= 2.0 * APART
    assert along[-1] >= path.contact[-1, 0] - 2.0 * APART
