"""What controls do by their own rules, against LinuxCNC's interpreter, and how programs are read by them."""

import re

import pytest
from support.rs274 import interpret, needs_rs274

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.base.findings import Severity
from fiveaxis.nc import find_dialect
from fiveaxis.nc.writing.tables import DIALECTS

LINUXCNC = find_dialect("linuxcnc").reading
RULED = ("fanuc", "haas", "linuxcnc", "sinumerik", "heidenhain")
HEAD = "G21 G90 G94 G17 G54\nG0 X0 Y0 Z15 A0 C0\n"
CYCLE = f"{HEAD}G81 X0 Y0 R2 Z-1 F100\nX30\nG80\nG0 Z30\nM2\n"
IN_CUT = f"{HEAD}G1 Z-1 F100\nX10\n{{}}\nX20\nG0 Z15\nM2\n"
NESTED = "(G1 X11 (OLD) Z-20. A-96.5)"
BAD, DOUBTFUL = Severity.ERROR, Severity.WARNING


def found(motion, code):
    """The only finding of a code: severity, line, message."""
    [finding] = [f for f in motion.findings if f.code == code]
    return finding.severity, finding.place.line, finding.message


def codes(motion):
    return {finding.code for finding in motion.findings}


# LinuxCNC's interpreter does what its table says, key by key.

# What a program begins in: a text that depends on it, and another word.
BEGINS = {
    "plane": ("G2 X1 Y1 I1 J0 F100", "G18"),
    "positions": ("G1 X1 F100\nX2", "G91"),
    "feed_mode": ("G1 X2 F100", "G93"),
    "return_level": ("G0 Z10\nG81 X0 Y0 Z-1 R2 F100\nX5", "G98"),
}
# A text that is refused, and one that isn't.
REFUSED = {
    "nested_comments": ("(a (b) c)\nM2", "(a b c)\nM2"),
    "numbered_skip": ("N5 /G1 X1 F100\nM2", "/G1 X1 F100\nM2"),
    "late_percent": ("G0 X1\n%\nG0 X2\nM2", "%\nG0 X1\n%\nG0 X2\nM2"),
    "machine_increments": ("G91 G53 G0 X1\nM2", "G91 G0 X1\nG90 G53 G0 X1\nM2"),
}


def interpreted(text, folder):
    """Whether LinuxCNC's interpreter runs a text to its end, and its moves, each with the feed in force."""
    path = folder / "part.ngc"
    path.write_text(text, encoding="ascii")
    run, moves, feed = interpret(path), [], ""
    for word, values in re.findall(r"(STRAIGHT_[A-Z]+|ARC_FEED|SET_FEED_RATE)\(([^)]*)\)", run.stdout):
        feed = values if word == "SET_FEED_RATE" else feed
        moves += [] if word == "SET_FEED_RATE" else [(word, values, feed)]
    return run.returncode == 0, moves


@needs_rs274
@pytest.mark.parametrize("key", BEGINS)
def test_linuxcnc_begins_in_what_its_table_says(tmp_path, key):
    text, other = BEGINS[key]
    bare = interpreted(f"{text}\nM2\n", tmp_path)
    assert interpreted(f"{getattr(LINUXCNC, key)}\n{text}\nM2\n", tmp_path) == bare
    assert interpreted(f"{other}\n{text}\nM2\n", tmp_path) != bare


@needs_rs274
@pytest.mark.parametrize("key", REFUSED)
def test_linuxcnc_refuses_what_its_table_says(tmp_path, key):
    assert getattr(LINUXCNC, key) == "refused"
    refused, read = REFUSED[key]
    assert not interpreted(f"{refused}\n", tmp_path)[0]
    assert interpreted(f"{read}\n", tmp_path)[0]


@needs_rs274
def test_linuxcnc_ends_at_the_words_of_its_table_and_the_second_percent_sign(tmp_path):
    one = interpreted("G0 X1\nM2\n", tmp_path)
    assert (one[0], len(one[1])) == (True, 1)
    # The stand-alone interpreter has no loop: there M99 ends a main program.
    for word in (*LINUXCNC.ends, *LINUXCNC.repeats):
        assert interpreted(f"G0 X1\n{word}\nG0 X2\n", tmp_path) == one
    assert interpreted("%\nG0 X1\n%\nG0 X2\nM2\n", tmp_path) == one
    assert not interpreted("G0 X1\nM17\n", tmp_path)[0]
    assert not interpreted("G0 X1\n", tmp_path)[0]


@needs_rs274
def test_linuxcnc_counts_words_without_a_point_in_units_as_its_table_says(tmp_path):
    assert (LINUXCNC.whole_words, LINUXCNC.whole_feed) == ("units", "units")
    assert interpreted("G1 X10 F100\nM2\n", tmp_path) == interpreted("G1 X10.0 F100.0\nM2\n", tmp_path)


def test_g53_by_increments_is_refused_where_the_control_refuses_it(read_of):
    text = f"{HEAD}G91 G53 G0 Z0\nM2\n"
    with pytest.raises(ToolpathError, match="refuses G53 under G91"):
        read_of(text, "linuxcnc")
    # Where nobody says it, the move is left out, and the position that follows is written whole.
    assert len(read_of(text.replace("M2", "G90 G0 X1 Y1 Z9\nG1 X2 F100\nM30"), "fanuc")) > 1


def test_every_key_of_the_tables_has_a_value_a_test_or_a_reason():
    fields = set(type(LINUXCNC).model_fields) - {"source", "unknown", "ends", "repeats"}
    assert fields == {*BEGINS, *REFUSED, "whole_words", "whole_feed", "change_moves"}
    assert {name for name, d in DIALECTS.items() if d.reading.source} == {
        *RULED,
        "heidenhain-m128",
        "linuxcnc-switchkins",
    }


def test_a_table_states_the_source_of_its_rules(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text('based_on = "fanuc"\n[reading]\nplane = "G17"\nsource = ""\n', encoding="utf-8")
    with pytest.raises(SettingError, match="reading needs a source"):
        find_dialect(path)


# The return level of cycles


def test_a_cycle_without_a_level_returns_where_the_control_begins(read_of):
    assert (
        read_of(CYCLE, "linuxcnc").positions[:, 2].tolist()
        == read_of(CYCLE.replace("G81", "G99 G81"), "linuxcnc").positions[:, 2].tolist()
    )
    assert (
        read_of(CYCLE, "haas").positions[:, 2].tolist()
        == read_of(CYCLE.replace("G81", "G98 G81"), "haas").positions[:, 2].tolist()
    )
    assert "return-level" not in codes(read_of(CYCLE, "haas")) | codes(read_of(CYCLE, name="part.ngc"))


def test_where_controls_begin_at_different_levels_both_are_told_and_the_lower_is_taken(read_of):
    severity, line, message = found(read_of(CYCLE), "return-level")
    assert (severity, line) == (DOUBTFUL, 3)
    assert "Z 15 mm by G98 (Haas NGC), or at R, 2 mm, by G99 (LinuxCNC)" in message
    assert read_of(CYCLE).positions[:, 2].tolist() == read_of(CYCLE, "linuxcnc").positions[:, 2].tolist()
    assert "parameter 3402" in found(read_of(CYCLE, "fanuc"), "return-level")[2]
    same = CYCLE.replace("Z15", "Z2")
    assert "return-level" not in codes(read_of(same)) | codes(read_of(CYCLE.replace("G81", "G98 G81")))


def test_what_a_fanuc_begins_in_is_told_where_the_program_relies_on_it(read_of):
    text = "G21\nG0 X0 Y0 Z5 A0 C0\nG90 G94 G1 X1 F100\nM30\n"
    severity, line, message = found(read_of(text, "fanuc"), "mode-assumed")
    assert (severity, line) == (DOUBTFUL, 2)
    assert "no G90 or G91 before this line" in message
    assert "mode-assumed" not in codes(read_of("G90 G94 G17\n" + text, "fanuc")) | codes(
        read_of(text, "haas")
    )
    assert (
        "no G93 or G94"
        in found(read_of(text.replace("G94 ", "").replace("G21", "G21 G90"), "fanuc"), "mode-assumed")[2]
    )
    arc = "G21 G90 G94\nG0 X0 Y0 Z5 A0 C0\nG2 X2 Y0 I1 J0 F100\nM30\n"
    assert "no G17, G18 or G19" in found(read_of(arc, "fanuc"), "mode-assumed")[2]


# Lines that controls read differently


@pytest.mark.parametrize("control", ["", "fanuc", "haas", "linuxcnc"])
def test_a_comment_within_a_comment_is_an_error_in_a_cut(read_of, control):
    severity, line, message = found(read_of(IN_CUT.format(NESTED), control), "read-differently")
    assert (severity, line) == (BAD, 5)
    assert ("LinuxCNC stops here" in message) == (control in ("", "linuxcnc"))
    assert ("reads 'Z-20.A-96.5)' as words" in message) == (control != "linuxcnc")


def test_a_comment_within_a_comment_is_a_warning_elsewhere(read_of):
    assert found(read_of(f"{NESTED}\n{IN_CUT.format('')}"), "read-differently")[:2] == (DOUBTFUL, 1)
    plain = IN_CUT.format("(a b) X11 (c) (d)\n; (e (f) g)")
    assert "read-differently" not in codes(read_of(plain)) | codes(read_of(plain, "linuxcnc"))
    # Behind the first bracket is no word: other controls do nothing else.
    assert "read-differently" not in codes(read_of(IN_CUT.format("(T1 (BALL 8))"), "fanuc"))


def test_what_linuxcnc_refuses_is_told_of_its_programs_alone(read_of):
    for line in ("N7 /X11", "/2 X11"):
        assert found(read_of(IN_CUT.format(line), "linuxcnc"), "read-differently")[0] == BAD
        assert "read-differently" not in codes(read_of(IN_CUT.format(line), "fanuc"))
    assert found(read_of(f"(part)\n%\n{IN_CUT.format('X11')}", "linuxcnc"), "read-differently")[:2] == (
        DOUBTFUL,
        2,
    )
    assert "read-differently" not in codes(read_of(f"%\n{IN_CUT.format('X11')}%\n", "linuxcnc"))


# Ends


@pytest.mark.parametrize("begin", ["", "%\n"])
def test_moves_behind_a_percent_sign_in_a_cut_are_not_run_and_an_error(read_of, begin):
    motion = read_of(begin + IN_CUT.format("%"))
    assert motion.positions[-1, 0] == 10.0
    severity, line, message = found(motion, "program-end")
    assert (severity, line) == (BAD, 5 + bool(begin))
    assert "2 lines of moves behind this % aren't run" in message


def test_a_percent_sign_alone_does_not_stop_the_spindle(read_of):
    severity, _, message = found(read_of(f"%\n{HEAD}G1 Z-1 F100\nG0 Z15\n%\n"), "program-end")
    assert severity == DOUBTFUL
    assert "no M2 or M30" in message
    assert "program-end" not in codes(read_of(f"%\n{IN_CUT.format('')}%\nG1 X1\n"))


@pytest.mark.parametrize("name", ["part.nc", "part.ngc", "part.mpf", "part.h"])
def test_a_program_without_an_end_is_told(read_of, name):
    texts = {
        "part.h": "BEGIN PGM part MM\nL X+0 Y+0 Z+5 A+0 C+0 FMAX\nL Z-1 F100\n{}",
        "part.mpf": "G71 G90 G54\nG0 X0 Y0 Z5 A0 C0\nG1 Z-1 F100\n{}",
    }
    text = texts.get(name, HEAD + "G1 Z-1 F100\n{}")
    severity, line, _ = found(read_of(text.format(""), name=name), "program-end")
    assert (severity, line) == (DOUBTFUL, 3)
    end = "END PGM part MM\n" if name == "part.h" else "M30\n"
    assert "program-end" not in codes(read_of(text.format(end), name=name))


def test_words_that_end_subprograms_are_told(read_of):
    text = f"{HEAD}G1 Z-1 F100\n"
    assert "begins a main program again" in found(read_of(f"{text}M99\n", "fanuc"), "program-end")[2]
    assert "ends no program" in found(read_of(f"{text}M17\n"), "program-end")[2]
    assert (
        "M17 ends a subprogram"
        in found(read_of("G71 G90\nG0 X0 Y0 Z5 A0 C0\nRET\n", name="a.mpf"), "program-end")[2]
    )


# Dwells


def test_a_long_dwell_in_a_cut_is_told(read_of):
    text = IN_CUT.format("G4 P{}")
    assert found(read_of(text.format(20), "linuxcnc"), "dwell-in-cut")[:2] == (DOUBTFUL, 5)
    assert "dwell-in-cut" not in codes(read_of(text.format(2), "linuxcnc"))
    assert "dwell-in-cut" not in codes(read_of(text.format(20), "fanuc"))
    assert "dwell-in-cut" in codes(read_of(text.format(20000), "fanuc"))
    assert "dwell-in-cut" not in codes(read_of(text.format(2).replace("M2", "G4 P20\nM2"), "linuxcnc"))
