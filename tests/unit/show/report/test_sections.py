"""Sections of the page: true minus signs, and figures named as what they are."""

import html
import re
from dataclasses import replace

import pytest

from fiveaxis.posture import FrontPoint
from fiveaxis.show import ReportDocument
from fiveaxis.show.report.facts import FrontProgram, FrontPrograms, SetupSearched, TriedSetup
from fiveaxis.show.report.page import compose_page
from fiveaxis.show.report.sections import front_section, setup_section

TRIED = TriedSetup((-5.0, 0.0, 0.0), (0.0, 0.0, -90.0), rough=1.0, kept_clear=None, energy=1.0, why="")


def test_a_searched_setup_has_true_minus_signs():
    ranges = {"angle": (-180.0, 180.0)}
    text = setup_section(SetupSearched(ranges, TRIED, TRIED, None, (TRIED,), 0.005, keeps_clear=False))
    assert "angle −180…180 deg" in text
    assert "−5, 0, 0" in text
    assert not re.search(r"-\d", text)


@pytest.mark.usefixtures("undrawn")
def test_the_difference_of_the_two_measures_has_a_true_minus_sign(solution, verdict):
    travel = {letter: 0.584 * joules for letter, joules in solution.energy.by_axis.items()}
    less = replace(solution, energy=replace(solution.energy, travel_by_axis=travel))
    page = compose_page(ReportDocument(less, verdict))
    assert "off the energy by −41.6\u2009%" in html.unescape(page)


def test_a_front_is_drawn_over_the_energy_that_its_table_lists(solution):
    first = FrontPoint(0.0, 0.0, solution.motion, solution.energy, 1.0, bend=0.1, steepest=0.02, fastest=0.1)
    points = (
        FrontProgram(first, 1, released=True),
        FrontProgram(replace(first, bend=0.05), 2, released=True),
    )
    text = front_section(FrontPrograms(points, dominated=3, picked=1))
    assert ">energy (J)</text>" in text
    assert "travel metric" not in text
