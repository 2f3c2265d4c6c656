"""Laws of `Report.merge`: the order of reports, and how often one comes, decide nothing."""

from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.base.errors import SettingError
from fiveaxis.base.findings import Finding, Gap, Place, Severity
from fiveaxis.check.verification.report import APPROACH, PATH, READING, Check, Report

CODES = ("tilt", "gouge", "axis-limit")
ROWS = (PATH, APPROACH, READING)
FIGURES = ("tilt_min_deg", "gouge_depth_mm", "limit_overrun_mm")

checks = st.builds(Check, st.sampled_from(CODES), st.sampled_from(ROWS))
places = st.builds(
    Place,
    location=st.none() | st.integers(0, 4),
    line=st.none() | st.integers(1, 3),
    file=st.none() | st.sampled_from(["a.nc", "b.nc"]),
)
findings = st.builds(
    Finding,
    st.sampled_from(Severity),
    st.sampled_from(CODES),
    st.sampled_from(["too far", "too deep"]),
    places,
    st.none() | st.floats(-9.0, 9.0),
)
sentences = st.sampled_from(["limits", "tilt", "gouges", "speed"])
claims = st.lists(st.tuples(sentences, st.none() | checks), unique=True).map(tuple)


def gaps(made: dict[Check, int]) -> st.SearchStrategy[tuple[tuple[Gap, Check | None], ...]]:
    """What a report may leave open: no check that it made."""
    open_checks = st.none() | checks.filter(lambda check: check not in made)
    gap = st.builds(Gap, st.sampled_from(["no mesh", "no range", "no speed"]), is_risk=st.booleans())
    return st.lists(st.tuples(gap, open_checks), unique=True).map(tuple)


@st.composite
def reports(draw: st.DrawFn) -> Report:
    found = draw(st.lists(findings, max_size=5))
    listed = Report.of_findings(found, draw(st.sampled_from(ROWS)))
    more = draw(st.dictionaries(checks, st.integers(0, 9), max_size=4))
    made = dict(Counter(listed.checks) | Counter(more)) | {c: 0 for c in more if not more[c]} | listed.checks
    return Report(
        findings=listed.findings,
        checks=made,
        figures=draw(st.dictionaries(st.sampled_from(FIGURES), st.none() | st.floats(-9.0, 9.0))),
        claims=draw(claims),
        gaps=draw(gaps(made)),
        about=draw(st.sampled_from([None, "digest"])),
    )


def unordered(report: Report) -> tuple[object, ...]:
    """A report without the order of its sentences; dictionaries are compared without theirs."""
    return (
        report.findings,
        report.checks,
        report.figures,
        set(report.claims),
        set(report.passed),
        set(report.gaps),
        report.about,
    )


@given(reports(), reports(), reports())
def test_merging_is_associative(a, b, c):
    assert a.merge(b).merge(c) == a.merge(b.merge(c)) == a.merge(b, c)


@given(reports(), reports())
def test_merging_is_commutative_but_for_the_order_of_sentences(a, b):
    assert unordered(a.merge(b)) == unordered(b.merge(a))
    assert a.merge(b).counts == b.merge(a).counts


@given(reports(), reports())
def test_a_report_that_comes_twice_counts_once(a, b):
    assert a.merge(a) == a
    both = a.merge(b)
    assert both.merge(a) == both == both.merge(b)


@given(reports(), reports())
def test_no_error_and_no_count_is_lost(a, b):
    both = a.merge(b)
    said = {(f.code, f.place, f.message) for f in both.findings if f.severity is Severity.ERROR}
    for report in (a, b):
        assert {(f.code, f.place, f.message) for f in report.findings if f.severity is Severity.ERROR} <= said
        assert all(both.counts[code] >= count for code, count in report.counts.items())
    assert both.ok == (a.ok and b.ok)


@given(reports(), reports())
def test_a_joint_report_is_no_better_than_any_of_its_parts(a, b):
    both = a.merge(b)
    for report in (a, b):
        for name, value in report.figures.items():
            if value is not None:
                worse = min if name == "tilt_min_deg" else max
                assert both.figures[name] == worse(both.figures[name], value)
        assert {gap for gap in report.gaps if gap[1] not in both.checks} <= set(both.gaps)


@given(reports(), reports())
def test_passed_is_what_no_part_failed_and_some_part_passed(a, b):
    both = a.merge(b)
    claimed = {sentence for report in (a, b) for sentence, _ in report.claims}
    assert set(both.passed) <= {*a.passed, *b.passed} <= claimed
    for report in (a, b):
        assert set(both.passed).isdisjoint({sentence for sentence, _ in report.claims} - {*report.passed})
    # Where neither has found anything, nothing is lost.
    clean = [replace(report, findings=()) for report in (a, b)]
    assert set(clean[0].merge(clean[1]).passed) == claimed


@given(reports(), st.sampled_from(Severity))
def test_a_finding_of_a_claims_own_check_shows_it_false_unless_it_is_a_note(a, severity):
    found = Report.of_findings([Finding(severity, "jump", "a fact", Place(1))], PATH)
    claim = replace(Report.of_findings(()), claims=(("turns", Check("jump", PATH)),))
    both = a.merge(claim).merge(found)
    assert ("turns" in both.passed) is (severity is Severity.NOTE)
    # On other rows the same check says nothing about these.
    elsewhere = Report.of_findings([Finding(severity, "jump", "a fact", Place(1))], APPROACH)
    assert "turns" in a.merge(claim, elsewhere).passed


@given(reports(), reports())
def test_what_one_of_them_checked_is_not_left_open(a, b):
    both = a.merge(b)
    assert all(settled_by not in both.checks for _, settled_by in both.gaps)


@given(reports(), st.integers(1, 9), st.integers(1, 9))
def test_one_check_on_the_same_rows_counts_once_and_on_others_adds_up(a, one, two):
    def of(rows: str, count: int) -> Report:
        found = [Finding(Severity.ERROR, "jump", "a fact", Place(1))]
        return replace(Report.of_findings(found, rows), checks={Check("jump", rows): count})

    same, other = a.merge(of(PATH, one), of(PATH, two)), a.merge(of(PATH, one), of(APPROACH, two))
    assert same.counts["jump"] == max(one, two)
    assert other.counts["jump"] == one + two


def test_reports_about_different_motions_are_refused():
    def of(about: str | None) -> Report:
        return Report((), {}, {}, (), (), about)

    with pytest.raises(SettingError, match="different motions"):
        of("abc").merge(of("def"))
    assert of("abc").merge(of(None)).about == "abc"
