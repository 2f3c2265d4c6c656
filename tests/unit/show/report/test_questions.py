"""The three answers: nothing is claimed beyond what was checked, and one number is one number."""

import re
from dataclasses import replace

import numpy as np

from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import Report
from fiveaxis.check.verification.report import Check
from fiveaxis.model import Energy, SpeedChange
from fiveaxis.posture import Optimum
from fiveaxis.posture.solution import AS_PROGRAMMED
from fiveaxis.show import ReportDocument
from fiveaxis.show.report.facts import Overriding, ProgramFigures
from fiveaxis.show.report.questions import Answer
from fiveaxis.show.report.words import saving

THIN = "\u2009"


def lines_of(answer: Answer) -> tuple[str, ...]:
    """The answer as lines of plain text, the answer itself first."""
    return (answer.text, *(f"{about}: {text}" for about, text in (*answer.details, *answer.folded)))


def test_a_verified_program_is_never_called_safe_while_something_is_not_checked(
    solution: Optimum, verdict: Report
) -> None:
    found = ReportDocument(solution, verdict).answers
    assert found.verdict == "partial"
    assert lines_of(found.safe)[:2] == (
        "Only in part: no errors, but not every risk was checked.",
        "Risk: gouges: add part (--part) to the job.",
    )
    every = ReportDocument(solution, replace(verdict, gaps=())).answers
    assert (every.verdict, every.safe.text) == ("safe", "Yes: whatever could do harm was checked and passed.")
    none = ReportDocument(solution, replace(verdict, claims=())).answers
    assert (none.verdict, none.safe.text) == ("unknown", "Unknown: nothing was checked.")


def test_warnings_are_counted_in_the_answer(solution: Optimum, unsafe_verdict: Report) -> None:
    warned = tuple(f for f in unsafe_verdict.findings if f.severity is Severity.WARNING)
    verdict = replace(unsafe_verdict, findings=warned, checks={Check("tip-deviation"): 30})
    text = ReportDocument(solution, verdict).answers.safe.text
    assert text == "Only in part: no errors, with 1 warning, but not every risk was checked."


def test_errors_answer_no_and_say_what_to_correct(
    solution: Optimum, unsafe_verdict: Report, program: ProgramFigures
) -> None:
    kept = {"axis-limit": 1500}
    found = ReportDocument(solution, unsafe_verdict, program=program, kept_back=kept).answers
    assert found.verdict == "unsafe"
    assert f"Kept back: No NC program was written, because of axis-limit (1{THIN}500)." in lines_of(
        found.safe
    )
    assert found.saved.details[0].text == "this doesn’t count until the errors are corrected."
    first, second = lines_of(found.next)
    assert first == "Correct the errors, and run it again."
    assert second.startswith("Correct: axis-limit (1500): A = -131.2 deg")
    assert second.endswith("narrow the tilt range")
    assert "G55" not in " ".join(lines_of(found.next))


def test_a_program_that_is_kept_back_is_not_to_be_run_whatever_else_was_accepted(
    solution: Optimum, unsafe_verdict: Report, program: ProgramFigures
) -> None:
    gouge = Finding(Severity.ERROR, "gouge", "too deep; lift the tool", Place(5), 1.0)
    verdict = replace(unsafe_verdict, findings=(*unsafe_verdict.findings, gouge))
    accepted = Overriding({"axis-limit": 1500}, "cup.toml")
    found = ReportDocument(
        solution, verdict, program=program, kept_back={"gouge": 1}, overriding=accepted
    ).answers
    assert found.verdict == "overridden"
    first, *others = lines_of(found.next)
    assert first == "Correct the errors, and run it again."
    assert [line.split(" (")[0] for line in others] == ["Correct: gouge"]


def test_the_time_is_compared_with_the_baselines(solution: Optimum, verdict: Report) -> None:
    normal = solution.compared["normal"]
    slower = replace(normal, energy=replace(normal.energy, time=1.25 * solution.energy.time))
    document = ReportDocument(replace(solution, compared={"normal": slower}), verdict)
    assert document.answers.saved.text.startswith(f"{saving(0.2)} time (")


def test_the_saving_is_one_number_against_the_cheapest_baseline(
    solution: Optimum, verdict: Report, program: ProgramFigures
) -> None:
    normal = solution.compared["normal"]
    dear = replace(normal, energy=replace(normal.energy, by_axis=dict.fromkeys("XYZAC", 1e6)))
    document = ReportDocument(replace(solution, compared={"greedy": dear, "normal": normal}), verdict)
    text = document.answers.saved.text
    assert text.count("%") == 1  # the times are equal
    assert re.search(r"of the best baseline, normal \(feed drives only\)\.$", text)
    share = 100.0 * (1.0 - solution.energy.total / normal.energy.total)
    assert f"; {share:.1f}{THIN}% less energy: " in text
    # Time first, then what shakes the machine.
    events = [e.starts + e.reversals for e in (solution.energy, normal.energy)]
    assert text.startswith("The same time (139.4 s or more; unknown: ")
    assert f"), {events[0]} starts and reversals against {events[1]}; " in text
    # Also where a program was revised in place that was dearer.
    revised = replace(solution, compared={AS_PROGRAMMED: dear, "normal": normal})
    program = replace(program, revises="lines 4-9")
    assert ReportDocument(revised, verdict, program=program).answers.saved.text == text


def test_with_a_known_base_power_the_saving_is_that_of_both(
    solution_with_base: Optimum, verdict: Report
) -> None:
    document = ReportDocument(solution_with_base, verdict)
    text = document.answers.saved.text
    share = 100.0 * document.saved("normal", "with_base")
    assert f"{abs(share):.1f}{THIN}%" in text
    assert "(feed drives and base power over the cycle time)" in text


def test_estimated_powers_give_the_saving_a_range(solution: Optimum, verdict: Report) -> None:
    figures = [
        replace(p, band=(0.5, 2.0)) if p.figure.endswith(" drive") else p for p in solution.machine.provenance
    ]
    estimated = replace(solution, machine=replace(solution.machine, provenance=tuple(figures)))
    document = ReportDocument(estimated, verdict)
    low, high = document.savings_range["normal"]
    about, text = document.answers.saved.details[0]
    assert about == "Range"
    assert low < high
    assert text.endswith(f"it is {saving(low)} to {saving(high)}.")


def test_a_saving_that_might_be_a_loss_is_not_known_and_has_no_per_cent(
    solution: Optimum, verdict: Report
) -> None:
    widest, narrow = "ZX", (0.99, 1.01)
    bands = {f"{c} drive": (0.01, 100.0 if c == "Z" else 2.0) if c in widest else narrow for c in "XYZAC"}
    figures = tuple(replace(p, band=bands.get(p.figure)) for p in solution.machine.provenance)
    by_axis = dict.fromkeys("XYZAC", 1000.0)
    normal = replace(solution.compared["normal"], energy=replace(solution.energy, by_axis=by_axis))
    dear = replace(normal, energy=replace(normal.energy, by_axis=dict.fromkeys("XYZAC", 1e6)))
    rough = replace(
        solution,
        machine=replace(solution.machine, provenance=figures),
        energy=replace(solution.energy, by_axis=by_axis | {"X": 500.0, "Z": 1400.0, "Y": 100.0}),
        compared={"greedy": dear, "normal": normal},
    )
    order = "measure the drives of Z, X, Y, A, C (fiveaxis calibrate), those of widest effect first"
    assert ReportDocument(rough, verdict).answers.saved.text.endswith(
        f"; energy not known: {order}. By the estimates 4{THIN}000 J against 5{THIN}000 J of the best "
        "baseline, normal (feed drives only)."
    )
    assert repr(rough).endswith(f" s, saving not known: {order}>")
    # All of the range is one sign: the number stands.
    loss = replace(rough, energy=dear.energy, compared={"normal": normal})
    assert f"; 99900.0{THIN}% more energy: " in ReportDocument(loss, verdict).answers.saved.text


def test_without_a_baseline_or_a_cost_nothing_is_said_to_be_saved(solution: Optimum, verdict: Report) -> None:
    alone = ReportDocument(replace(solution, compared={}), verdict)
    assert alone.answers.saved.text.startswith("Unknown: there is no baseline to compare with. It takes ")
    normal = solution.compared["normal"]
    idle = replace(normal, energy=replace(normal.energy, by_axis=dict.fromkeys("XYZAC", 0.0)))
    document = ReportDocument(replace(solution, compared={"normal": idle}), verdict)
    assert "; energy unknown: " in document.answers.saved.text


def test_what_to_do_names_start_offset_tool_and_control(
    solution: Optimum, verdict: Report, program: ProgramFigures
) -> None:
    document = ReportDocument(solution, verdict, program=program)
    assert lines_of(document.answers.next)[1:] == (
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
    solution: Optimum, verdict: Report, program: ProgramFigures
) -> None:
    prepared = replace(program.preparation, start=(), in_force=())
    listed = replace(program, language="apt", preparation=prepared)
    document = ReportDocument(solution, verdict, program=listed)
    assert document.answers.next.text.startswith("Post-process the cutter locations;")


def test_the_answers_are_plain_data_too(solution: Optimum, verdict: Report) -> None:
    found = ReportDocument(solution, verdict).answers
    data = found.as_dict()
    assert list(data) == ["verdict", "safe", "saved", "next"]
    assert [data[key]["question"] for key in ("safe", "saved", "next")] == [
        each.question for each in (found.safe, found.saved, found.next)
    ]
    text = "gouges: add part (--part) to the job."
    assert data["safe"]["details"][0] == {"about": "Risk", "text": text}
    assert not data["safe"]["details"][1:]


def steady(energy: Energy, starts: int, reversals: int) -> Energy:
    """The same energy of a program whose first axis starts and reverses so often."""
    events = starts + reversals
    steadiness = replace(
        energy.steadiness,
        block=np.arange(events),
        column=np.zeros(events, dtype=np.int64),
        reverses=np.arange(events) >= starts,
        time=np.zeros(events),
    )
    return replace(energy, steadiness=steadiness)


def test_starts_and_reversals_stand_beside_those_of_every_baseline(
    solution: Optimum, verdict: Report
) -> None:
    normal = solution.compared["normal"]
    counted = replace(
        solution,
        energy=steady(solution.energy, 51, 62),
        compared={"normal": replace(normal, energy=steady(normal.energy, 15, 1291))},
    )
    document = ReportDocument(counted, verdict)
    line = f"Steadiness: starts 51, reversals 62; normal: 15, 1{THIN}291."
    assert line in lines_of(document.answers.saved)
    alone = ReportDocument(replace(solution, compared={}), verdict)
    words = f"starts {solution.energy.starts}, reversals {solution.energy.reversals}."
    assert f"Steadiness: {words}" in lines_of(alone.answers.saved)


def test_without_accelerations_it_says_what_is_assumed_and_how_smooth_the_program_is(
    solution: Optimum, verdict: Report
) -> None:
    changes = {"X": SpeedChange(23.62, 7), "C": SpeedChange(np.radians(23.62), 7)}
    steadiness = replace(solution.energy.steadiness, changes=changes)
    changing = replace(solution, energy=replace(solution.energy, steadiness=steadiness))
    lines = lines_of(ReportDocument(changing, verdict, lines={"X": None, "C": 19}).answers.saved)
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


def test_where_accelerations_are_charged_nothing_is_assumed(solution: Optimum, verdict: Report) -> None:
    charged = replace(solution, energy=replace(solution.energy, timing="accelerations"))
    axes = tuple(replace(axis, max_acceleration=1.0) for axis in solution.machine.axes)
    stated = replace(solution, machine=replace(solution.machine, axes=axes))
    for one in (charged, stated):
        answers = ReportDocument(one, verdict).answers
        assert [detail.about for detail in answers.saved.folded] == ["Steadiness"]
        assert ("accelerations" in answers.saved.text) == (one is stated)
        assert "max_acceleration" not in answers.saved.text


def test_the_run_time_is_told_first_with_what_limits_it(solution: Optimum, verdict: Report) -> None:
    normal = solution.compared["normal"]
    fast = replace(
        solution.energy, time=80.0, timing="accelerations", limited={"feed": 60.0, "C speed": 20.0}
    )
    slow = replace(normal.energy, time=100.0, limited={"stops": 99.9, "feed": 0.1})
    timed = replace(solution, energy=fast, compared={"normal": replace(normal, energy=slow)})
    answers = ReportDocument(timed, verdict).answers
    assert answers.saved.details == ()
    assert [f"{about}: {text}" for about, text in answers.safe.details[-1:]] == [
        f"Limited by: feed 75{THIN}%, C speed 25{THIN}%; "
        f"normal: stops 100{THIN}%, 1 other less than 0.5{THIN}%.",
    ]
    told = f"20.0{THIN}% less time (80.0 s against 100.0 s or more; unknown: highest speeds), "
    assert answers.saved.text.startswith(told)
    programmed = replace(timed, compared={AS_PROGRAMMED: timed.compared["normal"], "normal": normal})
    assert "as-programmed: stops" in ReportDocument(programmed, verdict).answers.safe.details[-1].text


def test_one_axis_without_acceleration_is_named_alone(solution: Optimum, verdict: Report) -> None:
    axes = [replace(axis, max_acceleration=1.0) for axis in solution.machine.axes]
    axes[3] = solution.machine.axes[3]
    partly = replace(solution, machine=replace(solution.machine, axes=tuple(axes)))
    document = ReportDocument(partly, verdict)
    assert document.as_dict()["machine"]["acceleration_unknown"] == ["A"]
    assert "no max_acceleration of A: " in str(lines_of(document.answers.saved))
    assert "State it ([axes.A]), and" in str(lines_of(document.answers.saved))
