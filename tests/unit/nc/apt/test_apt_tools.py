"""Tools of APT files."""

import numpy as np
import pytest

from fiveaxis.base.errors import SeveralOperations, ToolError
from fiveaxis.base.findings import Severity
from fiveaxis.model import Tool, parse_tool
from fiveaxis.nc import read_toolpath
from fiveaxis.nc.apt.tools import cutter_from_apt


@pytest.fixture
def read(tmp_path):
    def read_text(text, **options):
        path = tmp_path / "part.apt"
        path.write_text(text, encoding="utf-8")
        return read_toolpath(path, **options)

    return read_text


def tool_findings(path):
    return [f for f in path.findings if f.code.startswith("tool-")]


@pytest.mark.parametrize(
    ("statement", "tool"),
    [
        ("CUTTER/6.,0,3.,0,0,0,51.", "flat:6"),
        ("CUTTER/ 10.000000,  5.000000,  0.000000,  5.000000,  0.000000,$\n  0.000000, 50.000000", "ball:10"),
        ("CUTTER/10,2,3,2,0,0,50", "bull:10:2"),
        ("CUTTER/10,2,0,0,0,0,50", "bull:10:2"),
        ("CUTTER/10,5", "ball:10"),
        ("CUTTER/10", "flat:10"),
        ("$$-> CUTTER / 10.000000", "flat:10"),
        ("$$->CUTTER / 10.0, 5.0", "ball:10"),
        ("TLDATA/MILL,32.0000,5.0000,75.0000,0.0000,0.0000", "bull:32:5"),
        ("TLDATA/MILL,30.0000,15.0000,75.0000,0.0000,0.0000", "ball:30"),
        ("TLDATA/MILL,25.0000,0.0000,75.0000,0.0000,0.0000", "flat:25"),
        ("TLDATA/DRILL,MILL,63.0000,0.0000,239.0000,178.0000,35.0000", "drill:63:178"),
        ("TLDATA/MILL,30.0000,0.0000,30.0000,0.0000,45.0000", "drill:30:90"),
        ("UNITS/INCHES\nCUTTER/1,.5,0,.5,0,0,4", "ball:25.4"),
    ],
)
def test_the_file_brings_its_tool(read, statement, tool):
    path = read(f"{statement}\nGOTO/1,2,3\n")
    assert str(path.tool) == tool
    assert tool_findings(path) == []


def test_the_last_tool_before_the_first_location_counts(read):
    path = read("CUTTER/20\nCUTTER/10,5\nLOADTL/1\nGOTO/1,2,3\nCUTTER/10,5\nLOADTL/1\nGOTO/1,2,4\n")
    assert str(path.tool) == "ball:10"
    assert tool_findings(path) == []


def test_the_callers_tool_wins_and_the_difference_is_reported(read):
    path = read("LOADTL/1\nCUTTER/10,2\nGOTO/1,2,3\n", tool=Tool.ball(8))
    assert str(path.tool) == "ball:8"
    (finding,) = tool_findings(path)
    assert finding.code == "tool-differs"
    assert finding.severity is Severity.WARNING
    assert "bull:10:2" in finding.message
    assert "ball:8" in finding.message
    assert finding.place.line == 2
    assert tool_findings(read("CUTTER/8,4,0,4,0,0,60\nGOTO/1,2,3\n", tool=Tool.ball(8))) == []


@pytest.mark.parametrize(
    "change",
    [
        "CUTTER/20,5",
        "LOADTL/2,1",
        "LOAD/TOOL,2,ADJUST,2",
        "LOAD/TOOL,2\nCUTTER/20,5",
        "CUTTER/20,5\nLOAD/TOOL,2",
        "TLDATA/BARREL,MILL,10,2",
    ],
)
def test_another_tool_in_mid_file_begins_another_operation(read, change):
    text = f"CUTTER/10,5\nLOADTL/1\nGOTO/1,2,3\n{change}\nGOTO/1,2,4\n"
    with pytest.raises(SeveralOperations, match="holds 2 operations") as caught:
        read(text)
    assert [each.first_line for each in caught.value.operations] == [3, 5 + change.count("\n")]
    first = read(text, operation=1)
    assert (str(first.tool), first.source.tolist(), first.operation.tool) == ("ball:10", [3], "1")
    second = read(text, operation=2, tool=Tool.ball(8))
    np.testing.assert_array_equal(second.tips(second.axis), [[1, 2, 4]])


@pytest.mark.parametrize(
    ("statement", "fault"),
    [
        ("PARTNO/1", "the file states no tool; say which with tool"),
        ("CUTTER/10,2,9,2,0,0,50", "'CUTTER/10,2,9,2,0,0,50': .* no supported cutter has these figures"),
        ("CUTTER/0", "'CUTTER/0': .*must be a number above 0"),
        ("CUTTER/10,2,3", "'CUTTER/10,2,3' isn't a known form of cutter"),
        ("CUTTER/D10", "'CUTTER/D10' isn't a known form of cutter"),
        ("CUTTER/nan", "isn't a known form of cutter"),
        ("TLDATA/TCUTTER,MILL,32,5", "isn't a known form of cutter"),
        ("TLDATA/MILL,32,5,75,0,0,1,2", "isn't a known form of cutter"),
        ("TLDATA/DRILL,MILL,10,1,80,118,35", "isn't a known form of cutter"),
        ("TLDATA/MILL,10,2,40,5,0", "no supported cutter has these figures"),
    ],
)
def test_a_tool_that_is_not_understood_must_come_from_the_caller(read, statement, fault):
    text = f"{statement}\nGOTO/1,2,3\n"
    with pytest.raises(ToolError, match=fault) as caught:
        read(text)
    assert caught.value.file.endswith("part.apt")
    path = read(text, tool=Tool.ball(8))
    assert str(path.tool) == "ball:8"
    codes = [f.code for f in tool_findings(path)]
    assert codes == ([] if statement.startswith("PARTNO") else ["tool-unread"])


@pytest.mark.parametrize(
    ("figures", "text"),
    [
        ((6.0, 0.0, 3.0, 0.0, 0.0, 0.0, 51.0), "flat:6"),
        ((10.0, 5.0), "ball:10"),
        ((10.0, 5.0, 0.0, 5.0, 0.0, 0.0, 40.0), "ball:10"),
        ((32.0, 5.0, 11.0, 5.0, 0.0, 0.0, 75.0), "bull:32:5"),
        ((8.0, 0.0, 0.0, 0.0, 31.0, 0.0, 40.0), "drill:8:118"),
        ((4.0, 2.0, 0.0, 2.0, 0.0, 5.0, 36.2028), "taper:4:5:10"),
    ],
)
def test_the_seven_figures_of_apt_give_the_tool(figures, text):
    tool, expected = cutter_from_apt(*figures), parse_tool(text)
    assert tool.cutter.shape == expected.cutter.shape
    np.testing.assert_allclose(tool.cutter.figures, expected.cutter.figures, atol=1e-4)


@pytest.mark.parametrize(
    "figures", [(10.0, 2.0, 5.0, 2.0), (10.0, 0.0, 5.0, 0.0, 10.0, 5.0), (0.0,), (10.0, 7.0)]
)
def test_apt_figures_of_an_unsupported_cutter_are_refused(figures):
    with pytest.raises(ToolError):
        cutter_from_apt(*figures)
