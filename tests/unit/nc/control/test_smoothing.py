"""The words by which a program says that its points are samples of a curve."""

import numpy as np
import pytest

from fiveaxis.model import Tool, load_machine
from fiveaxis.nc import read_toolpath
from fiveaxis.nc.control.program_toolpath import smoothed_lines
from fiveaxis.nc.source import Source

PAIRS = [
    ("COMPCAD", "COMPOF"),
    ("N10 COMPCURV ORIAXES", "N90 COMPOF"),
    ("CYCLE832(0.01,_FINISH,1)", "CYCLE832()"),
    ("CYCLE832(_camtolerance,1,1)", "CYCLE832(0,0,1)"),
    ("CYCLE832(0.02,3)", "CYCLE832(0.02,0)"),
    ("G05.1 Q1", "G05.1 Q0"),
    ("N100G05.1Q1", "N200G05.1Q0"),
    ("N5COMPCAD", "N9COMPOF"),
    ("CYCLE832 (0.05,1,1)", "CYCLE832 ()"),
    ("22 CYCL DEF 32.1 T0.01", "30 CYCL DEF 32.1 T0"),
    ("N5 G5.1Q3 R5", "N6 G5.1Q0"),
    ("G05 P10000", "G05 P0"),
    ("22 CYCL DEF 32.1 T0.01", "30 CYCL DEF 32.1"),
]


@pytest.mark.parametrize(("on", "off"), PAIRS)
def test_smoothing_lasts_from_the_block_that_switches_it_on_to_the_one_that_switches_it_off(on, off):
    lines = smoothed_lines(Source("part", ["G1 X1", on, "G1 X2", off, "G1 X3"]))
    np.testing.assert_array_equal(lines, [False, True, True, False, False])


@pytest.mark.parametrize(
    "line",
    [
        "G64 P0.01",
        "G187 P3",
        "(USE G05.1 Q1)",
        "; COMPCAD",
        "G1 X1 (G05 P10000)",
        "G5 X1 Y2",
        "G5 P2 Q3 X1",
        'MSG("COMPCAD")',
    ],
)
def test_what_blends_corners_or_is_a_comment_leaves_the_chords(line):
    assert not smoothed_lines(Source("part", [line, "G1 X2"])).any()


def arc(switch: str) -> str:
    angle = np.radians(np.arange(0.0, 60.0, 4.0))
    points = [f"G1 X{20 * np.cos(a):.5f} Y{20 * np.sin(a):.5f} F500" for a in angle]
    return "\n".join(
        ["G21 G90 G94", "G0 X20 Y0 Z5", "G1 Z0 F500", *points[:7], switch, *points[7:], "M30", ""]
    )


@pytest.mark.parametrize("switch", ["G05.1 Q1", "(nothing)"])
def test_the_cuts_of_a_program_are_curved_where_it_is_on(tmp_path, switch):
    file = tmp_path / "part.nc"
    file.write_text(arc(switch))
    path = read_toolpath(file, tool=Tool.ball(6), machine=load_machine("variaxis-630"))
    after = path.source > 11
    assert path.curved[after].all() == (switch != "(nothing)")
    assert not path.curved[~after].any()
    assert read_toolpath(file, tool=Tool.ball(6), path_shape="smooth").curved[5:].all()
    assert not read_toolpath(file, tool=Tool.ball(6), path_shape="chord").curved.any()
