"""A second tool in a program begins another operation, in every language."""

import pytest

import fiveaxis as fx

AXES = "X0 Y0 Z50 A0 C0"
ISO, SINUMERIK, KLARTEXT = "G21 G90 G54\n", "G90 G71 G54\n", "BEGIN PGM p MM\n"


@pytest.fixture
def tools(tmp_path, hayashi):
    """Return first line and tool of each operation."""

    def read_tools(text, suffix):
        path = tmp_path / f"part.{suffix}"
        path.write_text(text, encoding="utf-8")
        return [(found.first_line, found.tool) for found in fx.read_operations(path, machine=hayashi)]

    return read_tools


@pytest.mark.parametrize(
    ("suffix", "first", "second", "name"),
    [
        ("nc", ISO + "T1 M6\nG43.4 H1\n", "T2 M6 G43.4 H2\n", "2"),
        ("nc", ISO + "M06 T1\nG43.4 H1\n", "M06 T02\nG43.4 H2\n", "2"),
        ("nc", ISO + "T1 M6\nT2\nG43.4 H1\n", "M6\nG43.4 H2\n", "2"),
        ("nc", ISO + "T1\nG43.4 H1\n", "T2\nG43.4 H2\n", "2"),
        ("nc", ISO + "M6\nG43.4 H1\n", "M6\nG43.4 H2\n", ""),
        ("mpf", SINUMERIK + "T1 D1 M6\nTRAORI\n", "T2 D2 M6\n", "2"),
        ("mpf", SINUMERIK + 'T="a" M6\nTRAORI\n', 'T="b" M6\n', "B"),
        ("mpf", SINUMERIK + "T1 D1\nTRAORI\n", 'T="x"\n', "X"),
        ("h", KLARTEXT + "TOOL CALL 1 Z S500\nM128\n", "TOOL CALL 2 Z S500\n", "2"),
        ("h", KLARTEXT + 'TOOL CALL "a" Z S500\nM128\n', 'TOOL CALL "b" Z S500\n', "B"),
    ],
)
def test_a_second_tool_begins_another_operation(tools, suffix, first, second, name):
    moves = f"L {AXES} R0 FMAX\nL X+1 F100\n" if suffix == "h" else f"G0 {AXES}\nG1 X1 F100\n"
    line = len((first + moves + second).split("\n"))
    assert tools(first + moves + second + moves, suffix)[1:] == [(line, name)]
    # The same tool again doesn't count, nor does one without moves.
    assert len(tools(first + moves + moves + second, suffix)) == 1
    if name:
        assert len(tools(first + moves + first.split("\n")[1] + "\n" + moves, suffix)) == 1


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        ("nc", f"{ISO}T1 M6\nT2\nG43.4 H1\nG0 {AXES}\nG1 X1 F100\n"),
        ("nc", f"{ISO}T1 M6\nG43.4 H1\nG0 {AXES}\nG1 X1 F100\nT0 M6\nG0 Z90\n"),
        (
            "h",
            f"{KLARTEXT}TOOL CALL 1 Z S1\nL {AXES} R0 FMAX\nTOOL CALL S5\nL X+1 F100\nTOOL CALL 0 Z\nL Z+9\n",
        ),
    ],
)
def test_a_preselected_or_unloaded_tool_is_no_second_tool(tools, suffix, text):
    assert [tool for _, tool in tools(text, suffix)] == ["1"]
