"""Cutters in words."""

import pytest

from fiveaxis.model import Tool, parse_tool
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.show.report.words import describe_tool, what_stays


@pytest.mark.parametrize(
    ("short", "words"),
    [
        ("ball:8", "ball end mill, diameter 8 mm"),
        ("bull:16:4", "bull-nose end mill, diameter 16 mm, corner radius 4 mm"),
        ("taper:4:5:10", "tapered ball end mill, tip diameter 4 mm, half angle 5°, diameter 10 mm"),
    ],
)
def test_a_cutter_is_named_with_its_figures(short, words):
    assert describe_tool(parse_tool(short)) == words


def test_shank_and_holder_are_named_where_they_are_known():
    holder = Holder(60.0, (Section(40.0, 32.0), Section(20.0, 40.0, 50.0)))
    words = describe_tool(Tool.ball(8, shank_diameter=7.0, holder=holder))
    assert words.endswith("; shank 7 mm; stick-out 60 mm, holder 40 mm of 32 mm and 20 mm of 40 mm to 50 mm")


def test_only_a_ball_holds_its_centre():
    assert "centre" in what_stays(Tool.ball(8))
    assert "centre" not in what_stays(Tool.bull(16, 4))
