"""A solution knows what it was chosen within, and shows its locations as columns."""

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.collision import Fixture
from fiveaxis.energy import motion_energy
from fiveaxis.machine import Box

TILT = (10.0, 40.0)


@pytest.fixture(scope="module")
def solution():
    """An arc on the floor, beside which a block stands."""
    turn = np.radians(np.linspace(-60.0, 60.0, 30))
    contact = np.column_stack([15.0 * np.cos(turn), 40.0 * np.sin(turn), np.zeros_like(turn)])
    path = fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (30, 1)), fx.Tool.ball(8.0))
    block = Fixture("block", Box((20.0, 300.0, 120.0), (60.0, 0.0, 0.0)))
    machine = fx.load_machine("hayashi-640123")
    return fx.optimise(path, machine, tilt=TILT, fixtures=(block,), effort="quick")


def test_it_is_verified_against_its_own_bounds_and_fixtures(solution):
    around = solution.surroundings
    told = fx.verify(solution.motion, solution.machine, solution.toolpath, tilt=TILT, surroundings=around)
    own = solution.verify()
    assert [fixture.name for fixture in around.fixtures] == ["block"]
    assert own.as_dict() == told.as_dict()
    assert not any(finding.severity == "error" for finding in own.findings)


def test_columns_give_the_lean_and_the_power_of_every_axis_at_each_location(solution):
    columns = solution.columns()
    assert {len(column) for column in columns.values()} == {len(solution.toolpath)}
    assert columns["tilt_deg"].min() >= TILT[0] - 1e-6
    assert columns["tilt_deg"].max() <= TILT[1] + 1e-6
    # tan² tilt = tan² lead + tan² lean
    tilt, lead, lean = (np.tan(np.radians(columns[f"{name}_deg"])) ** 2 for name in ("tilt", "lead", "lean"))
    np.testing.assert_allclose(tilt, lead + lean, rtol=1e-9)
    powers = np.stack([columns[f"{letter}_W"] for letter in solution.motion.letters], axis=1)
    spent = (powers * columns["time_s"][:, None]).sum(axis=0)
    energy = motion_energy(solution.machine, solution.timed())
    np.testing.assert_allclose(spent, [energy.by_axis[letter] for letter in solution.motion.letters])


def test_a_frame_has_the_columns(solution):
    pytest.importorskip("pandas")
    assert list(solution.to_frame().columns) == list(solution.columns())


def test_its_preview_is_a_page_on_this_computer(solution):
    with solution.preview(open_browser=False) as page:
        assert page.url().startswith("http://127.0.0.1")
