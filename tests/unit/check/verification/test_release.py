"""No program leaves for a machine with errors that nobody has accepted by name."""

import re

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError, Unverified
from fiveaxis.base.findings import Finding, Place, Severity, risk
from fiveaxis.check import Gate, Report, require_report
from fiveaxis.check.verification.report import Check
from fiveaxis.model import Motion, motion_digest
from fiveaxis.nc import DIALECTS, compose_program


def found(*codes: str, severity: Severity = Severity.ERROR, about: str | None = None) -> Report:
    """A report with seven findings of each code."""
    findings = [Finding(severity, code, "a fact; a remedy", Place(location=1, line=3)) for code in codes]
    report = Report(tuple(findings), dict.fromkeys(map(Check, codes), 7), {}, (), ())
    checked = Report(
        (),
        {},
        {},
        (("axis limits of X at every location", None),),
        ((risk("collision of the spindle nose"), None),),
        about,
    )
    return report.merge(checked)


@pytest.fixture
def motion() -> Motion:
    return Motion("XYZAC", np.eye(5) / 2.0, np.ones(5), np.arange(5.0), np.zeros(5, int), np.arange(5))


def comments(program) -> str:
    return " ".join(re.sub(r"^[(;] ?|\)$", "", line) for line in program.lines if line[0] in "(;")


def test_an_unverified_text_says_so(motion, hayashi):
    assert "NOT VERIFIED" in comments(compose_program(motion, machine=hayashi))


def test_a_report_without_errors_opens_the_gate_and_the_header_says_what_it_rests_on(motion, hayashi):
    gate = Gate.of(found())
    assert gate.is_open
    text = comments(compose_program(motion, machine=hayashi, verdict=gate.notes))
    assert "NOT VERIFIED" not in text
    assert "verification: no errors in this text, read back" in text


@pytest.mark.parametrize("code", ["gouge", "axis-limit", "jump", "tip-deviation", "text-differs"])
def test_an_error_closes_the_gate(code):
    gate = Gate.of(found(code))
    assert not gate.is_open
    with pytest.raises(Unverified, match=rf"{code} \(7\).*override") as caught:
        gate.require_open()
    assert caught.value.exit_code == 1
    assert [f.code for f in caught.value.findings] == [code]


def test_warnings_and_notes_keep_nothing_back():
    for severity in (Severity.WARNING, Severity.NOTE):
        assert Gate.of(found("feed-over", severity=severity)).is_open


@pytest.mark.parametrize("control", DIALECTS)
def test_an_accepted_error_stands_in_the_header(motion, hayashi, control):
    gate = Gate.of(found("gouge", "jump"), ["jump", "gouge"])
    assert gate.is_open
    program = compose_program(motion, machine=hayashi, control=control, verdict=gate.notes)
    # Some controls know capitals only.
    text = " ".join(program.lines).lower()
    # A comment in round brackets can't hold another pair of them.
    assert re.search(r"overridden: jump [(\[]7[)\]], gouge [(\[]7[)\]]", text)
    assert "no errors" not in text


def test_each_error_is_accepted_by_itself():
    with pytest.raises(Unverified, match=r"found jump \(7\)"):
        Gate.of(found("gouge", "jump"), ["gouge"]).require_open()


@pytest.mark.parametrize(
    ("override", "text"), [("gauge", "did you mean gouge"), ("long-dwell", "keeps no program back")]
)
def test_an_override_of_nothing_that_exists_is_refused(override, text):
    with pytest.raises(SettingError, match=text):
        Gate.of(found(), [override])


def test_an_override_that_was_not_needed_is_reported():
    gate = Gate.of(found(), ["jump"])
    assert gate.is_open
    assert [f.code for f in gate.unused] == ["override-unused"]


def test_an_unverified_program_passes_only_if_that_is_requested():
    gate = Gate.unverified()
    assert not gate.is_open
    with pytest.raises(Unverified, match="which path it should follow"):
        gate.require_open()
    gate.require_open(unverified=True)


def test_a_report_of_another_motion_or_of_no_motion_is_refused(motion, hayashi, trunnion):
    require_report(found(about=motion_digest(motion, hayashi)), motion, hayashi)
    for about in (motion_digest(motion, trunnion), "0" * 64):
        with pytest.raises(SettingError, match="about another motion"):
            require_report(found(about=about), motion, hayashi)
    with pytest.raises(SettingError, match="a dict is no report"):
        require_report({"ok": True}, motion, hayashi)  # type: ignore[arg-type]
