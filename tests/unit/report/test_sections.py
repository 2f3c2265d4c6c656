"""Sections of the page: true minus signs, and figures named as what they are."""

import html
import re

import pytest

from fiveaxis.report import report_document
from fiveaxis.report.page import compose_page
from fiveaxis.report.sections import front_section, setup_section

TRIED = {"offset": [-5.0, 0.0, 0.0], "rotation_deg": [0.0, 0.0, -90.0], "energy": 1.0, "rough": 1.0}
TRIED |= {"why": "", "kept_clear": None}


def test_a_searched_setup_has_true_minus_signs():
    found = {"ranges": {"angle": (-180.0, 180.0)}, "given": TRIED, "chosen": TRIED, "saved": None}
    text = setup_section(found | {"tried": [TRIED], "least_saving": 0.005})
    assert "angle −180…180 deg" in text
    assert "−5, 0, 0" in text
    assert not re.search(r"-\d", text)


@pytest.mark.usefixtures("undrawn")
def test_the_difference_of_the_two_measures_has_a_true_minus_sign(solution, verdict):
    document = report_document(solution, verdict, inputs=[])
    document["energy"]["travel_error"] = -0.416
    assert "off the energy by −41.6\u2009%" in html.unescape(compose_page(solution, document))


def test_a_front_is_drawn_over_the_energy_that_its_table_lists():
    point = {"number": 1, "energy_J": 12.0, "bend_rad2": 0.1, "steepest_deg_mm": 1.0}
    point |= {"program_time_s": 9.0, "released": True}
    points = [point, point | {"number": 2, "energy_J": 14.0, "bend_rad2": 0.05}]
    text = front_section({"points": points, "picked": 1, "dominated": 3})
    assert ">energy (J)</text>" in text
    assert "travel metric" not in text
