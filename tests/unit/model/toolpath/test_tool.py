"""Tools in short form and as files."""

import numpy as np
import pytest

from fiveaxis.base.errors import ToolError
from fiveaxis.model import Tool, parse_tool
from fiveaxis.model.toolpath.tool import Holder, Section

FILE = """
shape = "bull"
diameter = 16
corner_radius = 4
length = 30
shank_diameter = 16

[holder]
stick_out = 60
sections = [
  { length = 20, diameter = 32 },
  { length = 40, diameter = 50, upper_diameter = 63 },
]
"""


@pytest.mark.parametrize(
    ("text", "tool"),
    [
        ("ball:10", Tool.ball(10)),
        (" FLAT : 8", Tool.flat(8)),
        ("bull:16:4", Tool.bull(16, 4)),
        ("lollipop:8:5", Tool.lollipop(8, 5)),
        ("taper:4:5:10", Tool.taper(4, 5, 10)),
        ("barrel:16:85:3", Tool.barrel(16, 85, 3)),
    ],
)
def test_a_short_form_is_a_tool_and_the_tool_its_short_form(text, tool):
    assert parse_tool(text) == tool
    assert parse_tool(str(tool)) == tool


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("saw:10", "tool 'saw:10': write ball:diameter, flat:diameter, bull:diameter:corner_radius"),
        ("ball:x", "'x' is no diameter"),
        ("ball", "0 figures where ball has 1; write ball:diameter"),
        ("bull:10", "1 figures where bull has 2; write bull:diameter:corner_radius"),
        ("ball:-3", "diameter is -3 mm; it must be a number above 0"),
        ("ball:inf", "diameter is inf mm"),
        ("bull:10:5", "corner radius 5 mm must be below half the diameter, 5 mm; write ball:10"),
        ("lollipop:8:8", "the neck must be thinner than the ball"),
        ("taper:4:95:10", "half angle must be below 90 deg"),
        ("taper:10:5:4", "upper diameter above 9.962 mm"),
        ("barrel:16:7:3", "a nose radius below and a barrel radius above half the diameter, 8 mm"),
        ("drill:8:180", "point angle must be below 180 deg"),
    ],
)
def test_an_invalid_tool_is_refused(text, said):
    with pytest.raises(ToolError, match=said):
        parse_tool(text)


def test_a_file_gives_cutter_shank_and_holder(tmp_path):
    path = tmp_path / "t8.toml"
    path.write_text(FILE)
    tool = parse_tool(str(path))
    assert str(tool) == "bull:16:4"
    assert tool.holder == Holder(60.0, (Section(20.0, 32.0), Section(40.0, 50.0, 63.0)))
    outline = np.vstack([part.outline for part in tool.parts()])
    np.testing.assert_allclose(outline[-4:], [[16, 60], [16, 80], [25, 80], [31.5, 120]])
    assert (np.diff(outline[:, 1]) >= 0.0).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("corner_radius = 4", ""), "shape 'bull' lacks corner_radius"),
        (
            ("corner_radius = 4", "corner_radius = 4\nneck_diameter = 3"),
            "has neck_diameter, which it doesn't use",
        ),
        (("diameter = 16", "diamter = 16"), "t8.toml:3: .*diamter"),
        (("stick_out = 60", "stick_out = 2"), "stick-out 2 mm must be at least 30 mm"),
        (("length = 30", "length = 3"), "cutting length 3 mm must be at least 4 mm"),
        (("diameter = 16\ncorner", "diameter = 6\ncorner"), "t8.toml: tool bull:6:4: corner radius 4 mm"),
        (("diameter = 32", "diameter = -32"), "t8.toml:10: .*diameter = -32 must be above 0"),
    ],
)
def test_a_wrong_file_is_refused_with_its_place(tmp_path, change, said):
    path = tmp_path / "t8.toml"
    path.write_text(FILE.replace(*change))
    with pytest.raises(ToolError, match=said):
        parse_tool(str(path))
