"""Tables of controls: those of the package, and custom ones."""

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Motion
from fiveaxis.nc import DIALECTS, compose_program, find_dialect


@pytest.fixture
def table(write):
    return lambda text, name="mine.toml": write(text, name)


def motion() -> Motion:
    return Motion("XYZAC", np.eye(5) / 2.0, np.ones(5), np.ones(5), np.zeros(5, int), np.arange(5))


def test_a_custom_table_writes_programs(table, hayashi):
    path = table('based_on = "fanuc"\nsuffix = ".tap"\nnumber = { linear = 3, rotary = 3 }\n')
    program = compose_program(motion(), machine=hayashi, control=path)
    assert (program.control, program.suffix) == ("mine", ".tap")
    assert "G1 X0.000 Y0.500 Z0.000 A0.000 C0.000 F60.000" in program.lines


def test_a_table_says_only_what_differs(table):
    mine = find_dialect(table('based_on = "haas"\n[feed.inverse_time]\nmost = 1000.0\n'))
    haas = DIALECTS["haas"]
    assert mine.feed["inverse_time"].most == 1000.0
    assert mine.feed["inverse_time"].word == "G93"
    assert mine.model_copy(update={"name": "haas", "feed": haas.feed}) == haas


def test_a_table_may_be_based_on_another_one_beside_it(table):
    table('based_on = "haas"\nsuffix = ".one"\n', "one.toml")
    assert find_dialect(str(table('based_on = "one.toml"\n'))).suffix == ".one"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('based_on = "fanuc"\nlongst = 80\n', "mine.toml:2: unknown key 'longst'; the nearest"),
        ('based_on = "fanuk"\n', "based_on = 'fanuk' isn't a known control; known: apt, fanuc"),
        ('based_on = "mine.toml"\n', "leads back to this table"),
        ("based_on = 3\n", "must be text in quotes"),
        ('based_on = "fanuc"\nlongest = "wide"\n', "longest = 'wide' must be a number"),
        ('based_on = "fanuc"\nrapid = "G0 {axes}"\n', r"has \{axes\}; what it may have is \{words\}"),
        ('based_on = "fanuc"\nrapid = "G0 {words"\n', "rapid = 'G0 {words'"),
        ('based_on = "fanuc"\nlinear = "G1 {words}"\n', r"needs \{words\} and \{feed\}"),
        ('based_on = "fanuc"\nrapid = "G0"\n', r"needs \{words\}"),
        ('based_on = "fanuc"\n[modes.tip]\non = ["G43.4 H{h}"]\n', r"has \{h\}; what it may have is"),
        ('based_on = "fanuc"\n[feed.inverse_time]\ndigits = 7\n', "either decimals or digits"),
        ('based_on = "fanuc"\nwork_offsets = "G5["\n', "work_offsets"),
        ('based_on = "heidenhain"\n[modes.axes]\nfeed = "inverse_time"\n', "there is no feed.inverse_time"),
        ('based_on = "haas"\n[modes.vector]\n', "needs directions"),
        ('based_on = "linuxcnc"\n[reset]\nblock = "G92 {axes}"\n', r"\{words\}"),
        ("suffix = '.nc'\n", "modes is missing"),
        ('based_on = "fanuc"\nline_number = "N "\n', r"line_number = 'N ' needs \{n\}, once"),
        ('based_on = "fanuc"\nline_number = "N{n}{n} "\n', r"needs \{n\}, once"),
        ('based_on = "fanuc"\nline_number = "N{n:04d} "\n', "formats what fills a bracket"),
        ('based_on = "fanuc"\nlinear = "G1 {words} {words} F{feed}"\n', r"and \{feed\}, each once"),
        ('based_on = "fanuc"\ntool_change = "M6"\n', r"tool_change = 'M6' needs \{tool\}"),
        ('based_on = "fanuc"\n[modes.tip]\nfirst = "G0 G43.4 H{offset}"\n', r"needs \{words\}, once"),
        ('based_on = "fanuc"\nlinear = ""\n', "modes.axes needs linear"),
        ('based_on = "fanuc"\ncomment = { template = "(x)" }\n', r"comment = '\(x\)' needs \{\}"),
        ('based_on = "fanuc"\n[unit]\nmm = ""\n', r"unit.mm = '' needs the word for it"),
        ('based_on = "fanuc"\nsafe_start = ["G21 é"]\n', "safe_start = 'G21 é' has 'é'; write plain ASCII"),
        ('based_on = "fanuc"\ncoolant = { flood = "M8 é" }\n', "coolant = 'M8 é' has 'é'"),
        ('based_on = "fanuc"\n[feed.inverse_time]\nleast = 9.0\nmost = 1.0\n', "least = 9 is above most = 1"),
        ("a = [\n", "is not valid TOML"),
    ],
)  # fmt: skip
def test_a_fault_of_a_table_is_named_with_its_place(table, text, message):
    with pytest.raises(SettingError, match=message) as caught:
        find_dialect(table(text))
    assert "mine.toml" in str(caught.value)


def test_a_percent_sign_of_a_table_is_written_as_it_is(table, hayashi):
    path = table(
        'based_on = "fanuc"\nlinear = "G1 {words} F{feed} (50% s)"\n'
        '[modulo]\nway = "shorter"\nword = "{letter}{value}%s"\n'
    )
    lines = compose_program(motion(), machine=hayashi, control=path, winding="modulo").lines
    assert "G1 X0.0000 Y0.5000 Z0.0000 A0.0000 C0.0000%s F60.000 (50% s)" in lines


def test_the_feed_may_stand_before_the_words(table, hayashi):
    path = table('based_on = "fanuc"\nlinear = "F{feed} G1 {words}"\n')
    lines = compose_program(motion(), machine=hayashi, control=path).lines
    assert "F60.000 G1 X0.0000 Y0.5000 Z0.0000 A0.0000 C0.0000" in lines


def test_a_table_that_is_not_there_is_named(tmp_path):
    with pytest.raises(SettingError, match=r"gone.toml: no such file"):
        find_dialect(tmp_path / "gone.toml")


def test_a_control_has_the_name_of_its_file_and_a_title():
    assert all(dialect.name == name and len(dialect.title) > 4 for name, dialect in DIALECTS.items())
