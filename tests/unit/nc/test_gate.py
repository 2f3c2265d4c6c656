"""No program leaves for a machine with errors that nobody has accepted by name."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import pytest

from fiveaxis.errors import SettingError, Unverified
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.motion import Motion
from fiveaxis.nc import DIALECTS, compose_program, write_program
from fiveaxis.verification.report import Report


@dataclass(frozen=True)
class Told:
    """A verdict that says what a test wants."""

    findings: tuple[Finding, ...] = ()
    counts: dict[str, int] = field(default_factory=dict)
    checked: tuple[str, ...] = ("axis limits of X at every location",)
    not_checked: tuple[str, ...] = ("collision of the spindle nose",)


def found(*codes: str, severity: Severity = Severity.ERROR) -> Told:
    findings = tuple(Finding(severity, code, "a fact", Place(location=1, line=3)) for code in codes)
    return Told(findings, dict.fromkeys(codes, 7))


@pytest.fixture
def motion() -> Motion:
    return Motion("XYZAC", np.eye(5) / 2.0, np.ones(5), np.arange(5.0), np.zeros(5, int), np.arange(5))


def comments(program) -> str:
    return " ".join(re.sub(r"^[(;] ?|\)$", "", line) for line in program.lines if line[0] in "(;")


def test_a_motion_without_a_report_is_marked(motion, hayashi):
    assert "NOT VERIFIED" in comments(compose_program(motion, machine=hayashi))


def test_a_verified_motion_says_what_was_checked_and_what_was_not(motion, hayashi):
    text = comments(compose_program(motion, machine=hayashi, report=Told()))
    assert "NOT VERIFIED" not in text
    assert "verification: no errors" in text
    assert "checked: axis limits of X at every location" in text
    assert "not checked: collision of the spindle nose" in text


@pytest.mark.parametrize("code", ["gouge", "axis-limit", "jump"])
def test_an_error_leaves_no_file(motion, hayashi, tmp_path, code):
    with pytest.raises(Unverified, match=rf"{code} \(7\).*override") as caught:
        write_program(motion, tmp_path / "p.ngc", machine=hayashi, report=found(code))
    assert caught.value.exit_code == 1
    assert [f.code for f in caught.value.findings] == [code]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("severity", [Severity.NOTE, Severity.WARNING])
def test_blocks_that_leave_their_way_are_kept_back_though_it_is_no_error(motion, hayashi, severity):
    told = found("tip-deviation", severity=severity)
    with pytest.raises(Unverified, match="tip-deviation"):
        compose_program(motion, machine=hayashi, report=told)
    assert "verification: no errors" in comments(
        compose_program(motion, machine=hayashi, report=found("speed", severity=Severity.WARNING))
    )


@pytest.mark.parametrize("severity", Severity)
def test_blocks_of_the_tip_are_led_by_the_control(motion, trunnion, severity):
    told = found("tip-deviation", severity=severity)
    with pytest.raises(Unverified, match="tip-deviation"):
        compose_program(motion, machine=trunnion, report=told)
    for override in ((), ("tip-deviation",)):
        program = compose_program(motion, machine=trunnion, coordinates="tip", report=told, override=override)
        assert "verification: no errors" in comments(program)


@pytest.mark.parametrize("control", DIALECTS)
def test_an_accepted_error_stands_in_the_header(motion, hayashi, control):
    program = compose_program(
        motion,
        machine=hayashi,
        control=control,
        report=found("gouge", "jump"),
        override=["jump", "gouge"],
    )
    # Some controls know capitals only.
    text = " ".join(program.lines).lower()
    # A comment in round brackets can't hold another pair of them.
    assert re.search(r"overridden: jump [(\[]7[)\]]", text)
    assert re.search(r"overridden: gouge [(\[]7[)\]]", text)
    assert "no errors" not in text


def test_each_error_is_accepted_by_itself(motion, hayashi):
    with pytest.raises(Unverified, match=r"found jump \(7\)"):
        compose_program(motion, machine=hayashi, report=found("gouge", "jump"), override=["gouge"])


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("gauge", "did you mean gouge"),
        ("long-dwell", "keeps no program back"),
        ("jump", "found none; take it away"),
    ],
)
def test_an_override_of_nothing_is_refused(motion, hayashi, override, text):
    with pytest.raises(SettingError, match=text):
        compose_program(motion, machine=hayashi, report=Told(), override=[override])


def test_an_override_needs_a_report(motion, hayashi):
    with pytest.raises(SettingError, match="give its report"):
        compose_program(motion, machine=hayashi, override=["gouge"])


def test_a_report_of_the_verification_is_a_verdict(motion, hayashi):
    report = Report((), {}, {}, ("limits",), ())
    assert "checked: limits" in comments(compose_program(motion, machine=hayashi, report=report))
