"""Figures that are files of their own: their words, their bytes, what they refuse."""

import numpy as np
import pytest
from support.quick_optimiser import find_front

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Tool, Toolpath
from fiveaxis.posture.strategy.front import Front
from fiveaxis.show.report.plots import write_front_figure


@pytest.fixture(scope="module")
def found(hayashi):
    angle = np.linspace(0.0, 2.0, 25)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(25, -0.2)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6))
    return find_front(path, hayashi, 3, tilt=(15, 75), effort="quick")


def test_the_figure_names_both_ends_and_what_the_axes_show(found, tmp_path):
    drawn = write_front_figure(found, tmp_path / "front.svg").read_text(encoding="utf-8")
    assert "<svg" in drawn
    for words in ("cheapest", "smoothest", "deg/mm", "energy of the feed drives"):
        assert words in drawn


def test_no_points_and_no_format_are_refused(found, tmp_path):
    with pytest.raises(SettingError, match="no points"):
        write_front_figure(Front((), 0, (found.solution,)), tmp_path / "front.svg")
    with pytest.raises(SettingError, match=r"let it end in \.svg or \.html"):
        write_front_figure(found, tmp_path / "front.pdf")
