"""Programs of several operations: the simultaneous ones are revised in place, the others stay."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.shop_programs import SHOPS
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.base.errors import Infeasible, JobError, ToolpathError
from fiveaxis.cli.commands import app
from fiveaxis.job import make_job, revise_operations, takes_operations
from fiveaxis.job.program_choice import Comparison
from fiveaxis.model import machine_text
from fiveaxis.nc.revised_words import Reviser

# So short an operation can hardly be cheaper without a start more.
QUICK = {"machine": "dmu50ev", "cone": 20.0, "effort": "quick", "allow": ("slower", "rougher")}


def shop_file(folder, control, notes=()):
    """The short program of a control, with comments on its tools."""
    shop = SHOPS[control]
    file = folder / f"bracket{shop.suffix}"
    file.write_text("\n".join(shop.lines(9, notes)) + "\n", encoding="utf-8")
    return file


@pytest.mark.usefixtures("undrawn")
def test_the_command_revises_all_whose_tool_the_comments_state(tmp_path):
    notes = ("(T3 D=6. CR=3. - BALL END MILL)", "( T5 - 8MM BALL MILL )", "(T1 D=50 FACE MILL)")
    file = shop_file(tmp_path, "fanuc", notes=notes)
    words = ("optimise", file, "-m", "dmu50ev", "--cone", "20", "--effort", "quick", "-o", tmp_path / "out")
    words += ("--allow", "slower,rougher")
    # Of an earlier run, beside whose results nothing is left.
    stale = (tmp_path / "out" / "program.tap", tmp_path / "out" / "operation-7" / "report.html")
    for path in stale:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("old", encoding="utf-8")
    result = CliRunner().invoke(app, [*map(str, words), "--json"])
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    told = [(o["number"], o["kind"], o["stays"] is None) for o in document["operations"]]
    assert told == [
        (1, "3-axis", False),
        (2, "drilling", False),
        (3, "simultaneous", True),
        (4, "3+2", False),
        (5, "simultaneous", True),
    ]
    assert not any(path.exists() for path in stale)
    assert (tmp_path / "out" / "program.nc").is_file()
    assert (tmp_path / "out" / "operation-5" / "report.html").is_file()
    report = json.loads((tmp_path / "out" / "operation-3" / "report.json").read_text(encoding="utf-8"))
    assert "of the program as it was" in report["answers"]["saved"]["text"]


def test_where_nothing_can_be_revised_the_error_says_why_of_each(tmp_path):
    file = shop_file(tmp_path, "fanuc")
    job = make_job(input=file, **QUICK)
    assert takes_operations(job)
    with pytest.raises(JobError) as caught:
        revise_operations(job)
    told = str(caught.value)
    assert "2: lines 15-18, drilling" in told
    assert "drilling work is never leaned" in told
    assert "name it (--tool 3=ball:10)" in told


def test_where_the_bounds_admit_no_posture_in_any_operation_the_locations_are_listed(tmp_path):
    file = shop_file(tmp_path, "fanuc")
    job = make_job(input=file, tool="3=ball:6", **QUICK, hold={"C": 140.0})
    with pytest.raises(
        Infeasible, match=r"no operation can be revised:\n(.*\n)*  3: .*no admissible"
    ) as told:
        revise_operations(job)
    assert told.value.exit_code == 3
    assert {finding.code for finding in told.value.findings} == {"no-posture"}


def test_a_tool_that_no_operation_has_is_refused(tmp_path):
    file = shop_file(tmp_path, "fanuc")
    with pytest.raises(JobError, match="tool 7=ball:6: no simultaneous operation has tool 7"):
        revise_operations(make_job(input=file, tool="7=ball:6", **QUICK))


def test_info_lists_the_operations_of_a_program(tmp_path):
    file = shop_file(tmp_path, "sinumerik")
    result = CliRunner().invoke(app, ["info", str(file), "-m", "dmu50ev", "--json"])
    assert result.exit_code == 0, result.output
    operations = json.loads(result.stdout)["operations"]
    assert [o["kind"] for o in operations] == ["3-axis", "drilling", "simultaneous", "3+2", "simultaneous"]
    assert [o["tool"] for o in operations] == ["MILL", "DRILL", "3", "4", "5"]
    assert operations[2]["cut_length"] > 50.0
    shown = CliRunner().invoke(app, ["info", str(file), "-m", "dmu50ev"])
    assert "simultaneous, TCP" in shown.output


def test_info_reads_a_program_as_the_other_commands_do(tmp_path):
    """From a known start the way to the first cut is in the path, and a unit scales all lengths."""
    text = "G21 G90 G54\nT1 M6\nS100 M3\nG1 X10. F500.\nX40. Y40.\nM30\n"
    file = tmp_path / "line.nc"
    file.write_text(text, encoding="utf-8")
    told = []
    for words in ("", "--start X0,Y0,Z5", "--start X0,Y0,Z5 --zero X1,Y2,Z3 --unit inch --operation 1"):
        result = CliRunner().invoke(app, ["info", str(file), "--json", *words.split()])
        assert result.exit_code == (0 if words else 2), result.output
        told.append(json.loads(result.stdout)["operations"][0]["cut_length"] if words else None)
    assert told[1] == pytest.approx(60.0)
    assert told[2] == pytest.approx(25.4 * 60.0)
    refused = CliRunner().invoke(app, ["info", "dmu50ev", "--zero", "X0"])
    assert refused.exit_code == 2
    assert "zero is for programs" in refused.output


MACRO = ("T9 M6", "S500 M3", "G65 P9001 X10. Y10.", "IF [#1 EQ 0] GOTO 10", "M5")


def with_macro(folder, restated=()):
    """The Fanuc program, with an operation that nobody can read before the third, and what follows it."""
    file = shop_file(folder, "fanuc")
    lines = file.read_text(encoding="utf-8").split("\n")
    at = lines.index("T3 M6")
    file.write_text(
        "\n".join([*lines[:at], *MACRO, lines[at], *restated, *lines[at + 1 :]]), encoding="utf-8"
    )
    return file


def test_what_cannot_be_read_is_carried_where_the_next_operation_states_everything(tmp_path):
    file = with_macro(tmp_path, ["G21 G90 G94 G17 G40 G49 G69 G54"])
    operations = fx.read_operations(file, machine=fx.load_machine("dmu50ev"))
    assert [o.kind for o in operations][2:4] == ["unread", "simultaneous"]
    assert (operations[2].first_line, operations[2].last_line) == (20, 24)
    made = revise_operations(make_job(input=file, tool="3=ball:6", **QUICK))
    assert made.parts[2].why.startswith("it can't be read: line 22")
    assert made.parts[-1].why == "its tool isn't known; name it (--tool 5=ball:10)"
    assert made.ok
    assert "\n".join(MACRO).encode() in made.data


def test_what_an_unread_operation_may_have_changed_has_to_be_stated_again(tmp_path):
    job = make_job(input=with_macro(tmp_path), tool="3=ball:6", **QUICK)
    with pytest.raises(ToolpathError, match=r"absolute or incremental.*may be another one here") as caught:
        revise_operations(job)
    assert "lines 20-24 can't be read" in str(caught.value)
    assert caught.value.line is not None


@pytest.mark.parametrize(("before", "after"), [(r" X(-?[0-9.]+)", r" X9\1"), (r" B([0-9.]+)", r" B1\1")])
def test_a_wrong_word_in_a_revised_line_keeps_the_program_back(before, after, tmp_path, monkeypatch):
    revise = Reviser.revision

    def wrong(self):
        revision = revise(self)
        line = sorted(revision.replaced)[5]
        texts = tuple(re.sub(before, after, f" {text}").strip() for text in revision.replaced[line])
        assert texts != revision.replaced[line]
        return replace(revision, replaced={**revision.replaced, line: texts})

    monkeypatch.setattr(Reviser, "revision", wrong)
    # The price of a wrong text says nothing about what verification finds in it.
    monkeypatch.setattr(Comparison, "is_worth", lambda *_: True)
    made = revise_operations(make_job(input=shop_file(tmp_path, "fanuc"), tool="3=ball:6", **QUICK))
    assert not made.ok
    assert "off-path" in made.outcomes[3].gate.kept


def test_python_revises_and_writes_a_program_in_one_call(tmp_path):
    file, new = shop_file(tmp_path, "linuxcnc"), tmp_path / "new.ngc"
    made = fx.revise_program(file, tool="5=ball:6", output=new, operation=5, **QUICK)
    assert list(made.outcomes) == [5]
    assert [part.why for part in made.parts if part.outcome is None] == ["it wasn't chosen"] * 4
    assert new.read_bytes() == made.data
    assert new.read_bytes() != file.read_bytes()


def test_a_program_that_breaks_what_is_asked_for_is_replaced_and_the_answer_says_why(tmp_path):
    job = make_job(input=shop_file(tmp_path, "fanuc"), tool="3=ball:6", max_turn=5.0, **QUICK | {"allow": ()})
    part = revise_operations(job).parts[2]
    assert part.verdict == "needed"
    assert part.outcome.chosen.comparison.faults
    saved = part.outcome.report.answers.saved.text
    assert saved.startswith("As it was, the program isn’t admitted (")


def test_every_new_line_states_the_whole_direction_of_the_tool(tmp_path):
    """A component that a control doesn't find is 0 to it."""
    turn = np.linspace(0.0, 0.7, 5)
    axes = np.column_stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), np.full(5, np.sqrt(0.75))])
    rows = [
        f"X{30 * np.cos(t):.3f} Y{30 * np.sin(t):.3f} Z2 A3={i:.4f} B3={j:.4f} C3={k:.4f}"
        for t, (i, j, k) in zip(turn, axes, strict=True)
    ]
    above = rows[0].replace("Z2", "Z60")
    lines = ["G71 G90 G94 G54", "T1 D1", "S5000 M3", "TRAORI", f"G0 {above}", f"G1 {rows[0]} F900", *rows[1:]]
    file = tmp_path / "vectors.mpf"
    file.write_text("\n".join([*lines, "G0 Z60", "TRAFOOF", "M30"]) + "\n", encoding="utf-8")
    [outcome] = revise_operations(make_job(input=file, tool="ball:6", **QUICK)).outcomes.values()
    assert outcome.ok
    text = outcome.program.text.lines
    assert len(text) > len(lines) + 3
    assert {sum(f"{name}=" in line for name in ("A3", "B3", "C3")) for line in text} == {0, 3}


@pytest.mark.slow
def test_a_list_chooses_several_operations(tmp_path):
    file, tools = shop_file(tmp_path, "fanuc"), "3=ball:6,5=ball:8"
    made = fx.revise_program(file, tool=tools, operation=[3, 5], **QUICK)
    assert list(made.outcomes) == [3, 5]
    # One cutter for both of them.
    job = make_job(input=file, tool="ball:6", program={"operation": (3, 5)}, **QUICK)
    assert takes_operations(job)


def test_verify_and_energy_take_a_list_of_operations_each_on_its_own(tmp_path):
    file, on = str(shop_file(tmp_path, "linuxcnc")), ["-m", "dmu50ev", "--rapid", "10000"]
    result = CliRunner().invoke(app, ["verify", file, *on, "--operation", "5,3", "--json"])
    told = json.loads(result.stdout)["operations"]
    assert [each["operation"]["number"] for each in told] == [5, 3]
    one = CliRunner().invoke(app, ["verify", file, *on, "--operation", "3", "--json"])
    alone = json.loads(one.stdout)
    assert told[1] == {"operation": told[1]["operation"]} | {n: alone[n] for n in alone if n in told[1]}
    result = CliRunner().invoke(app, ["energy", file, *on, "--operation", "3,5", "--json"])
    assert [each["operation"]["number"] for each in json.loads(result.stdout)] == [3, 5]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            "--operation 2,1",
            "be revised: 1: lines 8-11, 3-axis, tool 1, length offset 1, S2000 M3, G54: 3-axis",
        ),
        ("--operation 3,9", "has no operation 9; it holds 5"),
        ("--operation 3,x", "--operation '3,x' isn't of the form 3 or 3,5"),
        ("--operation 3,0", "program.operation[1] = 0 must be at least 1"),
        (
            "--operation 3,5 --control heidenhain",
            "operation = 3,5: operations are never merged",
        ),
    ],
)
def test_a_list_of_operations_that_cannot_be_is_refused(words, message, tmp_path):
    on = ["-m", "dmu50ev", "--tool", "ball:6", "--cone", "20"]
    result = CliRunner().invoke(app, ["optimise", str(shop_file(tmp_path, "fanuc")), *on, *words.split()])
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())


def test_words_that_tell_no_control_are_revised_as_those_of_the_machine_s(tmp_path):
    turn = np.linspace(0.0, 90.0, 9)
    # An axis that reverses in each block leaves something to save.
    tilts = 30.0 + turn / 9.0 + 4.0 * (np.arange(len(turn)) % 2)
    rows = [
        f"X{30 - t / 9:.3f} Y{t / 9:.3f} Z-5. A-{a:.3f} C{t:.3f}" for t, a in zip(turn, tilts, strict=True)
    ]
    text = ["G21 G90 G94 G54", "T1 M6", "S5000 M3", "G0 X30. Y0. Z50. A-30. C0.", f"G1 {rows[0]} F500."]
    text += [*rows[1:], "G0 Z50.", "M30"]
    file, machine = tmp_path / "wall.nc", fx.load_machine("hayashi-640123")
    file.write_text("\n".join(text), encoding="utf-8")
    given = {"cone": 20.0, "effort": "quick", "tool": "1=ball:6", "allow": ("slower", "rougher")}
    with pytest.raises(JobError, match="don't tell its control; state it in the machine's file"):
        fx.revise_program(file, "hayashi-640123", **given)
    own = tmp_path / "mill.toml"
    own.write_text(machine_text(replace(machine, control="fanuc")), encoding="utf-8")
    made = fx.revise_program(file, own, **given)
    assert made.ok
    assert list(made.outcomes) == [1]


def test_f_that_nobody_knows_the_meaning_of_is_not_written_anew(tmp_path):
    rows = [f"X{30 - i}. Y{i}. Z-5. A-{30 + i}. C{9 * i}." for i in range(9)]
    text = ["G21 G90 G94 G54", "T1 M6", "S5000 M3", "G0 X30. Y0. Z50. A-30. C0.", f"G1 {rows[0]} F500."]
    file, own = tmp_path / "wall.nc", tmp_path / "mill.toml"
    file.write_text("\n".join([*text, *rows[1:], "G0 Z50.", "M30"]), encoding="utf-8")
    own.write_text(machine_text(replace(fx.load_machine("hayashi-640123"), control="haas")), encoding="utf-8")
    with pytest.raises(ToolpathError, match=r"wall\.nc:6: .*nobody says what its F counts"):
        fx.revise_program(file, own, cone=20.0, effort="quick", tool="1=ball:6")


def test_axis_words_before_tcp_are_a_risk_where_their_zero_is_unknown(tmp_path):
    """Counted from the machine's zero, the words of the approach would be beyond the travel."""
    machine = fx.load_machine("dmu50ev").with_setup((-46.0, 0.0, 162.0))
    report = fx.verify_program(shop_file(tmp_path, "fanuc"), machine, operation=3, rapid=1e4)
    assert any("in moves by axis words" in gap.sentence for gap in report.risks)
    wrong = [f.place.line for f in report.findings if f.code == "axis-limit"]
    assert all(line > 26 for line in wrong)


@pytest.mark.parametrize("control", SHOPS)
def test_operations_by_axis_words_are_judged_only_where_their_zero_is_known(control, tmp_path):
    file, machine = shop_file(tmp_path, control), fx.load_machine("dmu50ev")
    for number in (1, 2):
        given = {"operation": number, "rapid": 1e4}
        report = fx.verify_program(file, machine, **given)
        assert "axis-limit" not in report.counts
        assert any("in moves by axis words" in gap.sentence for gap in report.risks)
        known = fx.verify_program(file, machine, zero={"X": -250, "Y": -200, "Z": -20}, **given)
        assert "Z = 30 mm is above the limit 0 mm" in " ".join(f.message for f in known.findings)
        assert not any("in moves by axis words" in gap.sentence for gap in known.risks)


def test_a_way_beyond_the_travel_is_found_from_any_zero(tmp_path):
    file, machine = shop_file(tmp_path, "fanuc"), fx.load_machine("dmu50ev")
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("\nX40.\n", "\nX460.5\n"), encoding="utf-8")
    report = fx.verify_program(file, machine, operation=1, rapid=1e4)
    [found] = [f for f in report.findings if f.code == "axis-limit"]
    assert found.message.startswith("X goes over 500.5 mm, beyond its travel of 500 mm")


@pytest.mark.parametrize(
    ("after", "trades", "is_worth"),
    [
        ({"total": 990.0}, (), True),
        ({"total": 996.0}, (), False),
        ({"total": 990.0, "time": 100.9}, (), True),
        ({"total": 990.0, "time": 101.1}, ("slower",), False),
        ({"total": 990.0, "starts": 11, "reversals": 11}, (), True),
        ({"total": 990.0, "time": 102.0, "starts": 12, "reversals": 11}, ("slower", "rougher"), False),
    ],
)
def test_a_text_is_worth_it_that_saves_enough_and_is_no_trade(after, trades, is_worth):
    """Half a percent less, at most one percent longer, at most a tenth more starts and reversals."""
    before = {"total": 1000.0, "time": 100.0, "starts": 10, "reversals": 10}
    compared = Comparison(SimpleNamespace(**before), SimpleNamespace(**(before | after)), "energy")
    assert compared.trades == trades
    assert compared.is_worth() is is_worth
    assert compared.is_worth(trades) is (after["total"] < 995.0)
