"""The three answers: nothing is claimed beyond what was checked, and one number is one number."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.posture import Solution
from fiveaxis.report import answers, report_document

THIN = "\u2009"
PREPARATION = {
    "tool_number": 3,
    "work_offset": "G55",
    "in_force": ["G21 G90", "G55", "T3 M6", "G0 G43.4 H3"],
    "start": {"A": -45.0, "C": 0.12345, "X": 1.5, "Y": -2.0, "Z": 408.8567},
    "unit": "mm",
    "notes": [
        {"about": "start", "text": "start with the tool clear of part and table"},
        {"about": "work offset", "text": "zero: the work offset is the workpiece origin"},
        {"about": "tool", "text": "tool length: measure it"},
        {"about": "control", "text": "parameter 19696 bit 5 is 0"},
    ],
}


def make_finding(location: int, code: str) -> dict[str, Any]:
    finding = Finding(Severity.ERROR, code, "too deep; lift the tool", Place(location), 1.0)
    return finding.as_dict()


@pytest.fixture
def prepared(program: dict[str, Any]) -> dict[str, Any]:
    return program | {"language": "blocks", "preparation": PREPARATION}


def test_a_verified_program_is_never_called_safe_while_something_is_not_checked(
    solution: Solution, verdict: dict[str, Any]
) -> None:
    found = answers(report_document(solution, verdict, inputs=[]))
    assert found.verdict == "partial"
    assert found.safe.lines == (
        "Verified, no errors; not everything was checked.",
        "Found: nothing.",
        "Not checked: gouges: no mesh of the part was given",
    )
    every = answers(report_document(solution, verdict | {"not_checked": []}, inputs=[]))
    assert (every.verdict, every.safe.text) == ("safe", "Yes: every check passed.")
    none = answers(report_document(solution, verdict | {"checked": []}, inputs=[]))
    assert (none.verdict, none.safe.text) == ("unknown", "Unknown: nothing was checked.")


def test_warnings_are_counted_in_the_answer(solution: Solution, unsafe_verdict: dict[str, Any]) -> None:
    warned = [f for f in unsafe_verdict["findings"] if f["severity"] == "warning"]
    verdict = unsafe_verdict | {"ok": True, "findings": warned, "counts": {"tip-deviation": 30}}
    text = answers(report_document(solution, verdict, inputs=[])).safe.text
    assert text == "Verified with 30 warnings, no errors; not everything was checked."


def test_errors_answer_no_and_say_what_to_correct(
    solution: Solution, unsafe_verdict: dict[str, Any], prepared: dict[str, Any]
) -> None:
    document = report_document(solution, unsafe_verdict, inputs=[], program=prepared)
    found = answers(document | {"kept_back": {"axis-limit": 1500}})
    assert found.verdict == "unsafe"
    assert f"Kept back: No NC program was written, because of axis-limit (1{THIN}500)." in found.safe.lines
    assert found.saved.details[0].text == "this doesn’t count until the errors are corrected."
    first, second = found.next.lines
    assert first == "Correct the errors, and run it again."
    assert second.startswith("Correct: axis-limit (1500): A = -131.2 deg")
    assert second.endswith("narrow the tilt range")
    assert "G55" not in " ".join(found.next.lines)


def test_a_program_that_is_kept_back_is_not_to_be_run_whatever_else_was_accepted(
    solution: Solution, unsafe_verdict: dict[str, Any], prepared: dict[str, Any]
) -> None:
    findings = [*unsafe_verdict["findings"], make_finding(5, code="gouge")]
    verdict = unsafe_verdict | {"findings": findings}
    document = report_document(solution, verdict, inputs=[], program=prepared)
    found = answers(document | {"kept_back": {"gouge": 1}, "overridden": {"axis-limit": 1500}})
    assert found.verdict == "overridden"
    first, *others = found.next.lines
    assert first == "Correct the errors, and run it again."
    assert [line.split(" (")[0] for line in others] == ["Correct: gouge"]


def test_the_saving_is_one_number_against_the_cheapest_baseline(
    solution: Solution, verdict: dict[str, Any]
) -> None:
    normal = solution.compared["normal"]
    dear = replace(normal, energy=replace(normal.energy, by_axis=dict.fromkeys("XYZAC", 1e6)))
    document = report_document(
        replace(solution, compared={"greedy": dear, "normal": normal}), verdict, inputs=[]
    )
    text = answers(document).saved.text
    assert text.count("%") == 1
    assert re.search(r"of the best baseline, normal \(feed drives only\)\.$", text)
    share = 100.0 * (1.0 - solution.energy.total / normal.energy.total)
    assert text.startswith(f"{share:.1f}{THIN}% less energy: ")


def test_with_a_known_base_power_the_saving_is_that_of_both(
    solution_with_base: Solution, verdict: dict[str, Any]
) -> None:
    document = report_document(solution_with_base, verdict, inputs=[])
    text = answers(document).saved.text
    share = 100.0 * document["savings"]["normal"]["with_base"]
    assert f"{abs(share):.1f}{THIN}%" in text
    assert "(feed drives and base power over the cycle time)" in text


def test_estimated_powers_give_the_saving_a_range(solution: Solution, verdict: dict[str, Any]) -> None:
    document = report_document(solution, verdict, inputs=[]) | {"savings_range": {"normal": [-0.1, 0.2]}}
    about, text = answers(document).saved.details[0]
    assert about == "Range"
    assert text.endswith(f"it is 10.0{THIN}% more to 20.0{THIN}% less.")


def test_without_a_baseline_or_a_cost_nothing_is_said_to_be_saved(
    solution: Solution, verdict: dict[str, Any]
) -> None:
    alone = report_document(replace(solution, compared={}), verdict, inputs=[])
    assert answers(alone).saved.text == "Unknown: there is no baseline to compare with."
    normal = solution.compared["normal"]
    idle = replace(normal, energy=replace(normal.energy, by_axis=dict.fromkeys("XYZAC", 0.0)))
    document = report_document(replace(solution, compared={"normal": idle}), verdict, inputs=[])
    assert answers(document).saved.text.startswith("Unknown: ")


def test_what_to_do_names_start_offset_tool_and_control(
    solution: Solution, verdict: dict[str, Any], prepared: dict[str, Any]
) -> None:
    document = report_document(solution, verdict, inputs=[], program=prepared)
    assert answers(document).next.lines[1:] == (
        "Start: the approach turns A −45°, C 0.123°, then goes to X 1.5, Y −2, Z 408.857 mm.",
        "Start: start with the tool clear of part and table.",
        "Work offset: G55.",
        "Work offset: zero: the work offset is the workpiece origin.",
        "Tool: T3, ball end mill, diameter 10 mm.",
        "Tool: tool length: measure it.",
        "Control: the program sets G21 G90, G55, T3 M6, G0 G43.4 H3.",
        "Control: parameter 19696 bit 5 is 0.",
    )


def test_cutter_locations_are_to_be_post_processed(
    solution: Solution, verdict: dict[str, Any], prepared: dict[str, Any]
) -> None:
    listed = prepared | {"language": "apt", "preparation": PREPARATION | {"start": {}, "in_force": []}}
    document = report_document(solution, verdict, inputs=[], program=listed)
    assert answers(document).next.text.startswith("Post-process the cutter locations;")


def test_the_answers_are_plain_data_too(solution: Solution, verdict: dict[str, Any]) -> None:
    found = answers(report_document(solution, verdict, inputs=[]))
    data = found.as_dict()
    assert list(data) == ["verdict", "safe", "saved", "next"]
    assert [data[key]["question"] for key in ("safe", "saved", "next")] == [a.question for a in found]
    assert data["safe"]["details"][1] == {
        "about": "Not checked",
        "text": "gouges: no mesh of the part was given",
    }


def steady(solution: Solution, **counts: tuple[int, int]) -> dict[str, Any]:
    """Figures of energy with given starts and reversals, by the name of the program."""
    energies = {"optimised": solution.energy, **solution.baselines}
    return {
        name: energies[name].as_dict() | {"starts": starts, "reversals": reversals}
        for name, (starts, reversals) in counts.items()
    }


def test_starts_and_reversals_stand_beside_those_of_every_baseline(
    solution: Solution, verdict: dict[str, Any]
) -> None:
    document = report_document(solution, verdict, inputs=[])
    counted = steady(solution, optimised=(51, 62), normal=(15, 1291))
    document |= {"energy": counted["optimised"], "baselines": {"normal": counted["normal"]}}
    line = f"Steadiness: starts 51, reversals 62; normal: 15, 1{THIN}291."
    assert line in answers(document).saved.lines
    alone = report_document(replace(solution, compared={}), verdict, inputs=[])
    counts = solution.energy.steadiness
    words = f"starts {sum(counts.starts.values())}, reversals {sum(counts.reversals.values())}."
    assert answers(alone).saved.lines[1] == f"Steadiness: {words}"


def test_without_accelerations_it_says_what_is_assumed_and_how_smooth_the_program_is(
    solution: Solution, verdict: dict[str, Any]
) -> None:
    document = report_document(solution, verdict, inputs=[])
    change = {"change": 23.62, "unit": "mm/s", "block": 7}
    document["energy"]["speed_changes"] = {"X": change, "C": change | {"unit": "deg/s", "line": 19}}
    lines = answers(document).saved.lines
    (assumed,) = [line for line in lines if line.startswith("Assumed: ")]
    assert assumed == (
        "Assumed: the axes start, stop and reverse without losing time, as the machine file states no "
        "max_acceleration of X, Y, Z, A, C: time and energy are lower bounds. State it ([axes.X] and so on), "
        "and starts and reversals are charged."
    )
    assert lines[-1] == (
        "Speed: the largest changes from one cutting block of the program to the next: X 23.6 mm/s "
        "(block 7), C 23.6 deg/s (line 19)."
    )


def test_where_accelerations_are_charged_nothing_is_assumed(
    solution: Solution, verdict: dict[str, Any]
) -> None:
    charged = replace(solution, energy=replace(solution.energy, timing="accelerations"))
    axes = tuple(replace(axis, max_acceleration=1.0) for axis in solution.machine.axes)
    stated = replace(solution, machine=replace(solution.machine, axes=axes))
    for one in (charged, stated):
        words = [detail.about for detail in answers(report_document(one, verdict, inputs=[])).saved.details]
        assert words == ["Time", "Steadiness"]


def test_one_axis_without_acceleration_is_named_alone(solution: Solution, verdict: dict[str, Any]) -> None:
    axes = [replace(axis, max_acceleration=1.0) for axis in solution.machine.axes]
    axes[3] = solution.machine.axes[3]
    partly = replace(solution, machine=replace(solution.machine, axes=tuple(axes)))
    document = report_document(partly, verdict, inputs=[])
    assert document["machine"]["acceleration_unknown"] == ["A"]
    assert "no max_acceleration of A: " in str(answers(document).saved.lines)
    assert "State it ([axes.A]), and" in str(answers(document).saved.lines)
