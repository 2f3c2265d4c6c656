"""The page's tables."""

import re
from dataclasses import replace

import numpy as np

from fiveaxis.base.findings import Finding, Place, Severity, group_findings
from fiveaxis.check import verify
from fiveaxis.model import SpeedChange
from fiveaxis.show import ReportDocument
from fiveaxis.show.report.tables import WORDS, baseline_table, causes_table, measured_table, steadiness_table

THIN = "\u2009"


def cells(text: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", text)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


def test_measured_figures_are_described_with_their_units():
    figures = {
        "tilt_max_deg": 75.027976,
        "speed_share": 0.5,
        "off": -1.5,
        "contact_error_mm": 8.1e-5,
        "held_axis_off_deg": None,
    }
    head, *rows = cells(measured_table(figures))
    assert head == ["measured in the program, the worst", "value"]
    assert rows == [
        ["largest angle of the tool axis", "75.03°"],
        ["speed, of an axis’s highest", f"50{THIN}%"],
        ["off", "−1.5"],
        ["tool off its path", f"0.000081{THIN}mm"],
        ["held axis off its angle", "not checked"],
    ]


def test_findings_without_a_place_are_one_row_with_the_others_folded():
    findings = [Finding(Severity.WARNING, "drive-estimated", f"axis {c} is <estimated>") for c in "XYZ"]
    findings += [Finding(Severity.WARNING, "feed-over", "too quick", Place(k), float(k)) for k in range(40)]
    findings.append(Finding(Severity.ERROR, "tilt", "too far", Place(3)))
    text = causes_table(group_findings(findings))
    rows = [row[:3] for row in cells(text)[1:]]
    assert rows == [
        ["error", "tilt", "1"],
        ["warning", "drive-estimated", "3"],
        ["warning", "feed-over", "40"],
    ]
    assert "<summary>2 more</summary><ul><li>axis Y is &lt;estimated&gt;</li>" in text


def test_a_table_has_a_caption_and_its_heads_say_what_they_head():
    text = measured_table({"off": 1.0})
    assert "<caption>" in text
    assert text.count('scope="col"') == 2
    assert text.count('scope="row"') == 1


def test_a_number_as_small_as_rounding_is_none():
    assert cells(measured_table({"contact_error_mm": 1.6e-14}))[1] == ["tool off its path", f"0{THIN}mm"]


def test_every_figure_of_a_verification_has_words(solution):
    figures = verify(solution.motion, solution.machine, solution.toolpath).figures
    assert set(figures) <= set(WORDS)


def test_starts_and_reversals_are_listed_by_axis_before_and_after(solution, verdict):
    document = ReportDocument(solution, verdict)
    head, *rows = cells(steadiness_table(document))
    names = [f"{what}, {name}" for what in ("starts", "reversals") for name in ("normal", "optimised")]
    assert head == ["axis", *names, "change of speed, optimised"]
    before, after = (energy.steadiness for energy in (solution.baselines["normal"], solution.energy))
    found = (before.starts, after.starts, before.reversals, after.reversals)
    for axis, *counts, change in rows[:-1]:
        assert counts == [str(each[axis]) for each in found]
        assert change.startswith(f"{after.changes[axis].size:.3g}" if axis in "XYZ" else "")
        assert change.endswith(f" (block {after.changes[axis].block})")
    assert [int(count) for count in rows[-1][1:-1]] == [sum(each.values()) for each in found]
    alone = ReportDocument(replace(solution, compared={}), verdict)
    assert cells(steadiness_table(alone))[0][1:3] == ["starts, optimised", "reversals, optimised"]


def test_an_axis_without_a_change_of_speed_has_none_in_the_table(solution, verdict):
    steadiness = replace(solution.energy.steadiness, changes={"C": SpeedChange(np.radians(0.5), 2)})
    turned = replace(solution, energy=replace(solution.energy, steadiness=steadiness), compared={})
    document = ReportDocument(turned, verdict, lines={"C": 1234})
    changes = [row[-1] for row in cells(steadiness_table(document))[1:]]
    assert changes == ["–", "–", "–", "–", f"0.5 deg/s (line 1{THIN}234)", ""]


def test_every_program_has_its_starts_and_reversals_beside_its_energy(solution, verdict):
    document = ReportDocument(solution, verdict)
    head, *rows = cells(baseline_table(document))
    assert head[-2:] == ["starts", "reversals"]
    for (name, *_, starts, reversals), energy in zip(
        rows, (solution.energy, solution.baselines["normal"]), strict=True
    ):
        assert (starts, reversals) == (str(energy.starts), str(energy.reversals)), name
