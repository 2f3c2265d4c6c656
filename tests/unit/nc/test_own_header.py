"""The header's comments on tool and feed are read as they were written, whatever the control."""

from itertools import cycle

import pytest

from fiveaxis.model import parse_tool
from fiveaxis.nc import DIALECTS
from fiveaxis.nc.own_header import SETUP, set_up_as_stated, stated_feed, stated_tool, tool_comments
from fiveaxis.nc.source import load_source
from fiveaxis.nc.writing.header import comment_lines

TOOLS = ("ball:8", "bull:16:4", "taper:4:5:10", "barrel:16:85:3")
PROGRAMS = sorted(name for name, dialect in DIALECTS.items() if dialect.language == "blocks")


@pytest.mark.parametrize(("control", "tool"), list(zip(PROGRAMS, cycle(TOOLS), strict=False)))
def test_tool_and_feed_are_read_as_they_were_written(tmp_path, control, tool):
    comments = tool_comments(parse_tool(tool), 1234.5 / 60.0)
    lines = [
        line
        for name, text in comments.items()
        for line in comment_lines(f"{name}: {text}", DIALECTS[control].comment)
    ]
    path = tmp_path / "program.nc"
    path.write_text("\n".join(["machine: a tool: ball:99", *lines]) + "\n")
    source = load_source(path)
    assert stated_tool(source) == parse_tool(tool)
    assert stated_feed(source) == pytest.approx(1234.5 / 60.0)


@pytest.mark.parametrize("text", ["(TOOL: 10MM BALL)", "(tool: mill.toml)", "(tool: ball:8:9:7)", "(tool 3)"])
def test_what_another_program_says_of_its_tool_is_no_tool_of_ours(tmp_path, text):
    path = tmp_path / "program.nc"
    path.write_text(f"{text}\n(feed: fast)\nG1 X1\n")
    source = load_source(path)
    assert stated_tool(source) is None
    assert stated_feed(source) is None


@pytest.mark.parametrize("control", PROGRAMS)
def test_the_setup_is_read_as_it_was_written_also_from_a_comment_of_several_lines(tmp_path, control, hayashi):
    there = hayashi.with_setup((-123.456789, 1e-7, 55.0), (0.25, -90.0, 12.5))
    path = tmp_path / "program.nc"
    comment = SETUP.write(*there.setup.offset, *there.setup.rotation_deg)
    lines = comment_lines(f"{comment}; turn the offset", DIALECTS[control].comment)
    path.write_text("\n".join([*lines, "G1 X1"]) + "\n")
    found, [told] = set_up_as_stated(hayashi, load_source(path))
    assert found.setup == there.setup
    assert told.code == "setup-read"
    elsewhere = hayashi.with_setup((1.0, 2.0, 3.0))
    assert set_up_as_stated(elsewhere, load_source(path)) == (elsewhere, ())
