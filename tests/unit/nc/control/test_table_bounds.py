"""Programs are held to what the table of their control says that it takes."""

import pytest

import fiveaxis as fx

HEAD = "G21 G90 G94 G17 G40 G49 G80\nT1 M6\nS5000 M3\nG54\nG0 G43.4 H1 X0. Y0. Z50. A0. C0.\nG1 Z5. F500.\n"
END = "\nX20. A5.\nM30\n"


def told(tmp_path, text: str, control: str = "fanuc", name: str = "part.nc") -> list[tuple[str, str, int]]:
    file = tmp_path / name
    file.write_text(text)
    report = fx.verify_program(file, fx.load_machine("hayashi-640123"), tool=fx.Tool.ball(8), control=control)
    codes = ("beyond-control", "whole-word")
    return [(f.code, f.severity.name, f.place.line) for f in report.findings if f.code in codes]


@pytest.mark.parametrize(
    "line",
    [
        "T123456789",
        "S200000 M3",
        "G43.4 H2001 X0. Y0. Z5. A0. C0.",
        "(feed 50% of the book)",
        "G1 X10." + 130 * " " + "Y5.",
    ],
)
def test_what_a_fanuc_does_not_take_is_told_with_its_line(line, tmp_path):
    assert told(tmp_path, f"{HEAD}{line}{END}") == [("beyond-control", "WARNING", 7)]


@pytest.mark.parametrize("line", ["T12345678", "S99999 M3", "(T999999999 S999999)", "#101=[5.]"])
def test_what_a_fanuc_takes_is_no_finding(line, tmp_path):
    assert told(tmp_path, f"{HEAD}{line}{END}") == []


@pytest.mark.parametrize(("offset", "found"), [("G54.1 P301", True), ("G54.1P300", False), ("G59", False)])
def test_a_work_offset_is_one_that_the_control_has(offset, found, tmp_path):
    text = f"{HEAD}{END}".replace("G54\n", f"{offset}\n")
    assert told(tmp_path, text) == [("beyond-control", "WARNING", 4)] * found


def test_the_limits_are_those_of_the_programs_control(tmp_path):
    text = f"{HEAD}S200000 M3{END}"
    assert told(tmp_path, text, "linuxcnc", "part.ngc") == []
    assert told(tmp_path, text) == [("beyond-control", "WARNING", 7)]


@pytest.mark.parametrize(
    ("comment", "severity"), [("abort,worn", "ERROR"), ("py,move()", "WARNING"), ("msg,ready", None)]
)
def test_comments_on_which_linuxcnc_acts_are_told(comment, severity, tmp_path):
    head = HEAD.replace("G43.4 H1", "G43 H1")
    found = told(tmp_path, f"{head}({comment.replace('()', '')}){END}", "linuxcnc", "part.ngc")
    assert found == ([] if severity is None else [("beyond-control", severity, 7)])


def test_a_word_without_a_point_is_told_where_a_setting_decides_what_it_counts(tmp_path):
    text = f"{HEAD}X10 Y0{END}"
    assert told(tmp_path, text) == [("whole-word", "WARNING", 7)]
    assert told(tmp_path, text, "haas") == [("whole-word", "WARNING", 7)]
    assert told(tmp_path, text.replace("X10", "X0"), "fanuc") == []
    feed = text.replace("X10", "X10.").replace("F500.", "F500")
    assert told(tmp_path, feed, "haas") == [("whole-word", "WARNING", 6)]
    assert told(tmp_path, feed, "fanuc") == []
    linuxcnc = text.replace("G43.4", "G43")
    assert told(tmp_path, linuxcnc, "linuxcnc", "part.ngc") == []
