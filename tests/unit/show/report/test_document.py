import hashlib
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from fiveaxis.base.errors import InputError
from fiveaxis.check import Report
from fiveaxis.posture import Optimum
from fiveaxis.posture.bound.lower_bound import LowerBound
from fiveaxis.show import ReportDocument, describe_input, write_json
from fiveaxis.show.report.facts import ProgramFigures

KEYS = [
    "answers",
    "toolpath",
    "locations",
    "path_shape",
    "curved_moves",
    "energy",
    "baselines",
    "missing_baselines",
    "moved_baselines",
    "rates",
    "axes",
    "savings",
    "savings_range",
    "bound",
    "summary",
    "findings",
    "verification",
    "program",
    "budget",
    "solver",
    "kkt",
    "machine",
    "tool",
    "tool_in_words",
    "tilt",
    "residuals",
    "inputs",
    "units",
    "kept_back",
]


def test_the_document_has_its_keys_in_a_fixed_order(solution: Optimum, verdict: Report) -> None:
    document = ReportDocument(solution, verdict).as_dict()
    assert list(document) == KEYS
    measures = ["total", "by_axis", "most", "base", "with_base", "time", "feed_time"]
    travel = ("travel", "travel_by_axis", "travel_error")
    steadiness = ("starts", "starts_by_axis", "reversals", "reversals_by_axis", "speed_changes")
    assert list(document["energy"]) == [*measures, "timing", "limited", *travel, *steadiness, "by_kind"]
    assert list(document["energy"]["by_axis"]) == list("XYZAC")


def test_the_document_repeats_the_figures_of_the_solution(solution: Optimum, verdict: Report) -> None:
    document = ReportDocument(solution, verdict).as_dict()
    assert document["locations"] == 360
    assert document["energy"] == solution.energy.as_dict()
    assert document["baselines"]["normal"] == solution.baselines["normal"].as_dict()
    assert document["residuals"] == solution.residuals()
    assert document["missing_baselines"] == {"as-programmed": "the input has no tool axes"}
    assert document["tilt"] == {"low": 15.0, "high": 75.0, "reference": "normal"}
    assert document["tool"] == "ball:10"


def test_savings_are_shares_of_the_baseline_in_every_measure(
    solution_with_base: Optimum, verdict: Report
) -> None:
    saved = ReportDocument(solution_with_base, verdict).as_dict()["savings"]["normal"]
    after, before = solution_with_base.energy, solution_with_base.baselines["normal"]
    assert saved["travel"] == pytest.approx(1.0 - after.travel / before.travel, rel=1e-12)
    assert saved["total"] == pytest.approx(1.0 - after.total / before.total)
    total_after, total_before = (e.total + 2763.0 * e.time for e in (after, before))
    assert saved["with_base"] == pytest.approx(1.0 - total_after / total_before)


def test_a_saving_with_unknown_base_power_is_null(solution: Optimum, verdict: Report) -> None:
    assert ReportDocument(solution, verdict).as_dict()["savings"]["normal"]["with_base"] is None


def test_a_baseline_that_costs_nothing_has_no_saving(solution: Optimum, verdict: Report) -> None:
    normal = solution.compared["normal"]
    still = replace(normal.energy, by_axis=dict.fromkeys("XYZAC", 0.0))
    idle = replace(solution, compared={"normal": replace(normal, energy=still)})
    assert ReportDocument(idle, verdict).as_dict()["savings"]["normal"]["total"] is None


def test_stages_keep_their_order_and_a_search_has_no_start(solution: Optimum, verdict: Report) -> None:
    stages = ReportDocument(solution, verdict).as_dict()["solver"]
    assert [s["status"] for s in stages] == ["found", "Solve_Succeeded"]
    assert stages[0]["before"] is None
    assert list(stages[1]) == ["name", "status", "before", "after"]


def test_the_machine_has_the_source_of_every_figure(solution: Optimum, verdict: Report) -> None:
    machine = ReportDocument(solution, verdict).as_dict()["machine"]
    assert (machine["name"], machine["code"], machine["axes"]) == ("hayashi-640123", "640123", "XYZAC")
    figures = {f["figure"]: f for f in machine["figures"]}
    assert figures["A limits"]["assumed"] is True
    assert figures["Z drive"]["assumed"] is False
    assert "Hayashi" in figures["Z drive"]["source"]


def test_what_is_not_a_finite_number_becomes_null(solution: Optimum, verdict: Report) -> None:
    verdict = replace(verdict, figures={"nothing": math.nan, "everything": math.inf, "some": 1.5})
    figures = ReportDocument(solution, verdict).as_dict()["verification"]["figures"]
    assert figures == {"nothing": None, "everything": None, "some": 1.5}


def test_folders_of_the_computer_stay_out_of_the_document(
    solution: Optimum, unsafe_verdict: Report, tmp_path: Path
) -> None:
    file = str(tmp_path / "vase.csv")
    findings = [replace(f, place=replace(f.place, file=file)) for f in unsafe_verdict.findings]
    unsafe_verdict = replace(unsafe_verdict, findings=tuple(findings))
    moved = replace(solution, toolpath=replace(solution.toolpath, name=file))
    text = json.dumps(ReportDocument(moved, unsafe_verdict).as_dict())
    assert str(tmp_path) not in text
    assert '"toolpath": "vase.csv"' in text


def test_a_document_read_back_is_the_document_written(
    solution: Optimum, unsafe_verdict: Report, tmp_path: Path
) -> None:
    document = ReportDocument(solution, unsafe_verdict)
    path = write_json(document, tmp_path / "report.json")
    assert json.loads(path.read_text(encoding="utf-8")) == document.as_dict()
    assert path.read_bytes().endswith(b"}\n")


def test_an_input_is_known_by_name_hash_and_size(tmp_path: Path) -> None:
    file = tmp_path / "path.apt"
    file.write_bytes(b"GOTO / 1, 2, 3\n")
    expected = {"name": "path.apt", "sha256": hashlib.sha256(b"GOTO / 1, 2, 3\n").hexdigest(), "size": 15}
    assert describe_input(file) == expected


def test_an_input_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.apt: no such file"):
        describe_input(tmp_path / "gone.apt")


def test_a_program_with_an_error_makes_the_whole_run_unsound(
    solution: Optimum, unsafe_verdict: Report, program: ProgramFigures
) -> None:
    document = ReportDocument(solution, unsafe_verdict, program=program).as_dict()
    assert document["verification"]["ok"] is False
    assert document["verification"]["counts"] == unsafe_verdict.counts
    assert document["program"]["inserted"] == 12


def test_the_document_has_the_lower_bound(solution: Optimum, verdict: Report) -> None:
    document = ReportDocument(solution, verdict).as_dict()
    assert document["bound"] is None
    half = LowerBound(0.5 * document["energy"]["travel"], "travel", 7)
    bound = ReportDocument(replace(solution, bound=half), verdict).as_dict()["bound"]
    assert bound["gap"] == pytest.approx(0.5)
    assert bound["in_words"] == "at most 50.0% of the travel metric could still be saved by any posture"
