"""The dress-up for FreeCAD, in FreeCAD itself."""

import shlex
from itertools import pairwise
from typing import Any

import pytest
from support.freecad import FEED, FIVEAXIS, in_freecad, needs_freecad, wavering_commands

pytestmark = needs_freecad

DRESSED = """
obj = dressup.make(base, given["options"], given["program"])
found = {"path": plain(obj), "answer": obj.Answer, "base": plain(base), "members": members()}
obj.touch()
document.recompute()
found["again"] = plain(obj)
second = dressup.make(obj, given["options"], given["program"])
found["second"] = [plain(second), second.Answer, members()]
document.undo()
found["undone once"] = members()
document.undo()
found["undone"] = [members(), plain(base), document.getObject("PosturesDressup") is None]
answer(found)
"""


@pytest.fixture(scope="module")
def dressed(tmp_path_factory) -> Any:
    """An operation dressed up, the dress-up too, and both undone; the calls of fiveaxis are counted."""
    folder = tmp_path_factory.mktemp("freecad")
    calls, program = folder / "calls", folder / "counted.sh"
    program.write_text(f'echo called >> {shlex.quote(str(calls))}\nexec {FIVEAXIS} "$@"\n')
    found = in_freecad(folder, DRESSED, program=f"sh {shlex.quote(str(program))}")
    return found | {"calls": len(calls.read_text().splitlines())}


@pytest.mark.slow
def test_a_better_path_comes_back_with_the_feed_in_mm_per_second(dressed):
    assert "% less time" in dressed["answer"]
    assert "Safe to run?" in dressed["answer"]
    cuts = [words for name, words in dressed["path"] if name == "G1"]
    assert len(cuts) >= 40
    assert {words["F"] for words in cuts if "F" in words} == {FEED}
    before = [words for name, words in dressed["base"] if name == "G1"]
    assert [words["A"] for words in cuts if "A" in words] != [words["A"] for words in before if "A" in words]
    turned = [sum(abs(b["A"] - a["A"]) for a, b in pairwise(each[1:])) for each in (before, cuts)]
    assert turned[1] < 0.5 * turned[0]


@pytest.mark.slow
def test_commands_that_are_not_revised_keep_every_digit_and_comments(dressed):
    base, path = dressed["base"], dressed["path"]
    assert [list(each) for each in wavering_commands()] == base
    assert path[:5] == base[:5]
    assert path[3][1] == {"X": -30.0 + 1e-9, "Y": 0.0, "F": 50.0}
    assert path[-2:] == base[-2:]


@pytest.mark.slow
def test_the_dress_up_stands_in_the_job_in_place_of_the_base_until_it_is_undone(dressed):
    assert dressed["members"] == ["PosturesDressup"]
    assert dressed["second"][2] == ["PosturesDressup001"]
    assert dressed["undone once"] == ["PosturesDressup"]
    assert dressed["undone"] == [["Wall"], dressed["base"], True]


@pytest.mark.slow
def test_a_path_that_is_already_better_stays_and_the_answer_says_so(dressed):
    path, answer, _ = dressed["second"]
    assert path == dressed["path"]
    assert answer.startswith("The path of PosturesDressup stays: your program is already better")


@pytest.mark.slow
def test_fiveaxis_runs_again_only_when_something_has_changed(dressed):
    assert dressed["again"] == dressed["path"]
    assert dressed["calls"] == 2  # of two dress-ups


REFUSED = """
obj = dressup.make(base, given["options"], given["program"])
answer([plain(obj) == plain(base), obj.Answer, obj.Done])
"""


def _slow(given: dict[str, Any], message: str) -> Any:
    """A case in which fiveaxis itself refuses: it starts, which takes a second."""
    return pytest.param(given, message, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"program": "no-such-fiveaxis"}, "no-such-fiveaxis can't be run: "),
        _slow({"options": "-m no-such-machine --tool ball:6"}, "ended with 2: error: unknown machine"),
        _slow(
            {"commands": [("G91", {}), *wavering_commands()]},
            "ended with 2: error: the path:4: A by an increment",
        ),
        _slow({"options": "-m linuxcnc-xyzac-trt"}, "its tool isn't known"),
    ],
)
def test_a_failure_leaves_the_path_of_the_base_and_is_told(given, message, tmp_path):
    same, answer, done = in_freecad(tmp_path, REFUSED, **given)
    assert same
    assert answer.startswith("The path of Wall stays: ")
    assert message in answer
    assert done == ""


READ = """
commands = [Path.Command(name, words) for name, words in given["commands"]]
lines = [dressup.line_of(command) for command in commands]
known = dict(zip(lines, commands))
found = {"lines": lines, "read": []}
for text in given["new"]:
    try:
        found["read"].append([[c.Name, c.Parameters] for c in dressup.commands_of(text, known)])
    except ValueError as fault:
        found["read"].append(str(fault))
answer(found)
"""


def test_lines_and_commands_have_other_units_of_the_feed_and_modal_words(tmp_path):
    commands = [
        ("G0", {"X": 1.0, "F": 100.0}),
        ("G1", {"X": 1.0 / 3.0, "Z": -0.5, "F": 2.5}),
        ("G2", {"X": 5.0, "I": 2.5, "J": 0.0, "K": 0.0}),
        ("G43.4", {"H": 12.0}),
        ("(a note)", {}),
    ]
    new = [
        ["G1 X2. F600.", "X3. A-1.5", "(a note)", "N7 Y4. F.6 ; back"],
        ["G1 F150. X0.333333 Z-0.5", "X9."],
        ["G93 G1 X1. F2."],
        ["G2 X1. I3."],
        ["G1 X#5"],
    ]
    found = in_freecad(tmp_path, READ, commands=commands, new=new)
    assert found["lines"] == ["G0 X1.", "G1 F150. X0.333333 Z-0.5", "G2 I2.5 X5.", "G43.4 H12", "(a note)"]
    modal, other, inverse, *refused = found["read"]
    assert modal == [
        ["G1", {"X": 2.0, "F": 10.0}],
        ["G1", {"X": 3.0, "A": -1.5}],
        ["(a note)", {}],
        ["G1", {"Y": 4.0, "F": 0.01}],
    ]
    assert other == [["G1", {"X": 1.0 / 3.0, "Z": -0.5, "F": 2.5}], ["G1", {"X": 9.0}]]
    # Posts write 60 times F in every mode.
    assert inverse == [["G93", {}], ["G1", {"X": 1.0, "F": 2.0 / 60.0}]]
    assert refused == ["the new line 'G2 X1. I3.' isn't understood", "the new line 'G1 X#5' isn't understood"]
