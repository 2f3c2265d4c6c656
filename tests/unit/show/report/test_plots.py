"""Figures that are files of their own: their words, their bytes, what they refuse."""

import numpy as np
import pytest
from support.quick_optimiser import find_front

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Tool, Toolpath
from fiveaxis.show.report.facts import FrontProgram, FrontPrograms
from fiveaxis.show.report.plots import write_front_figure


@pytest.fixture(scope="module")
def found(hayashi):
    angle = np.linspace(0.0, 2.0, 25)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(25, -0.2)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6))
    points = find_front(path, hayashi, 3, tilt=(15, 75), effort="quick").points
    return FrontPrograms(tuple(FrontProgram(p, k, True) for k, p in enumerate(points, start=1)), 0, 1)


def test_the_figure_numbers_its_solutions_and_names_what_the_axes_show(found, tmp_path):
    drawn = write_front_figure(found, tmp_path / "front.svg").read_text(encoding="utf-8")
    assert "<svg" in drawn
    numbers = [f">{each.number}</text>" for each in found.points]
    for words in ("What steadiness costs (feed drives only)", "bends Σ‖Δρ‖² (rad²)", "energy (J)", *numbers):
        assert words in drawn


def test_another_format_is_refused(found, tmp_path):
    with pytest.raises(SettingError, match=r"let it end in \.svg or \.html"):
        write_front_figure(found, tmp_path / "front.pdf")
