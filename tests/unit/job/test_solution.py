"""A solution knows what it was chosen within, and shows its locations as columns."""

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.check import Fixture
from fiveaxis.model import Box, motion_energy

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


def test_a_summary_says_cost_baseline_and_findings(solution):
    first, *rest = solution.summary().splitlines()
    name, saved = min(solution.savings().items(), key=lambda item: item[1])
    assert f"{solution.energy.total:.0f} J in {solution.energy.time:.1f} s" in first
    assert f"{100.0 * saved:.1f} % less than {name}" in first
    causes = (*solution.toolpath.findings, *solution.verify().findings)
    codes = {finding.code for finding in causes}
    assert {line.partition(" ")[0] for line in rest} == (codes or {"verification:"})


class Drawn:
    """Axes that keep what is drawn on them."""

    def __init__(self):
        self.lines, self.labels, self.has_legend = {}, [], False

    def plot(self, x, y, label):
        self.lines[label] = (x, y)

    def set_xlabel(self, text):
        self.labels.append(text)

    set_ylabel = set_xlabel

    def legend(self):
        self.has_legend = True


def test_a_plot_has_values_and_powers_of_every_axis_along_the_path(solution):
    values, powers = Drawn(), Drawn()
    solution.plot((values, powers))
    columns = solution.columns()
    assert list(values.lines) == [f"{axis.letter}, {axis.unit}" for axis in solution.machine.axes]
    for axis in solution.machine.axes:
        along, angles = values.lines[f"{axis.letter}, {axis.unit}"]
        np.testing.assert_array_equal(angles, columns[f"{axis.letter}_{axis.unit}"])
        np.testing.assert_array_equal(powers.lines[axis.letter][1], columns[f"{axis.letter}_W"])
        assert along[0] == 0.0
        assert along[-1] > 60.0
    assert values.has_legend
    assert powers.has_legend


def test_an_energy_has_a_row_per_drive(solution):
    columns = solution.energy.columns()
    assert dict(zip(columns["drive"], columns["energy_J"], strict=True)) == solution.energy.by_axis
    assert columns["starts"].sum() == solution.energy.starts
