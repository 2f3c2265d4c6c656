"""Broken APT files: one error each, with file, line and text."""

import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import Tool
from fiveaxis.nc import read_toolpath


def fail(path):
    with pytest.raises(ToolpathError) as caught:
        read_toolpath(path, tool=Tool.ball(10))
    assert caught.value.file == str(path)
    assert len(str(caught.value)) < 600, "a message for people"
    return caught.value


@pytest.fixture
def fault(tmp_path):
    def read_text(text):
        path = tmp_path / "part.apt"
        path.write_text(text, encoding="utf-8")
        return fail(path)

    return read_text


def test_a_file_cut_off_within_a_number_is_recognised_by_its_last_line(data, tmp_path):
    whole = (data / "toolpaths" / "nx_ust_a.cls").read_text(encoding="ascii")
    cut = whole.index("GOTO/784.0000,3.6875,-97.5000")
    path = tmp_path / "cut.cls"
    path.write_text(whole[: cut + len("GOTO/784.0000,3.6")], encoding="ascii")
    error = fail(path)
    assert error.line == whole[:cut].count("\n") + 1
    assert "'GOTO/784.0000,3.6' has 2 numbers" in error.message


@pytest.mark.parametrize(
    "text",
    [
        "X" * 10_000_000,
        "GOTO/" + "1," * 2_000_000,
        "GOTO/" + "1" * 10_000_000,
        "UNITS/" + "M" * 10_000_000,
        "FEDRAT/" + "M" * 10_000_000,
        "CYCLE/DRILL," + "M" * 10_000_000,
        "CYCLE/DRILL," + "1," * 1_000_000,
        "A" + " " * 10_000_000 + "B/1",
        "TLON,GOFWD/(CIRCLE/" + "(" * 10_000_000,
        " " * 10_000_000 + "GOTO/1,2",
    ],
    ids=lambda text: text.strip()[:12],
)
def test_a_line_of_ten_megabytes_is_refused_or_has_no_moves(fault, text):
    error = fault("GOTO/1,2,3\n" + text + "\nGOTO/0,0,nan\n")
    assert error.line in (2, 3)


def test_a_statement_of_a_million_lines_is_refused(fault):
    error = fault("GOTO/1,2,3\nGOTO/" + "1,$\n" * 1_000_000 + "1\n")
    assert error.line == 2
    assert "has 1000001 numbers" in error.message


def test_an_invalid_vector_is_refused(fault):
    assert fault("GOTO/1,2,3,0,0,1.0005\nGOTO/1,2,3,0,0,1.002\n").line == 2


def test_a_file_of_no_kind_is_refused_as_its_suffix_says(fault):
    assert "no GOTO" in fault("hello\n").message
