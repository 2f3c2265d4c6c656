"""Findings by cause: what a person reads of a thousand of them."""

import json

import pytest

from fiveaxis.base.findings import Finding, Place, Severity, group_findings, sort_findings

LEAN = "tool axis at {} deg to the normal is above the bound 80 deg; optimise again or widen the range"


def lean(location: int, degrees: float, severity: Severity = Severity.ERROR) -> Finding:
    place = Place(location, location + 1, "part.csv")
    return Finding(severity, "tilt", LEAN.format(degrees), place, degrees - 80.0)


def test_a_cause_is_one_line_with_count_worst_value_first_place_and_what_to_do():
    (cause,) = group_findings([lean(811, 81.5), lean(640, 80.5), lean(812, 81)])
    assert str(cause) == (
        "error: tilt (3): tool axis at 81.5 deg to the normal is above the bound 80 deg, worst at "
        "part.csv:812, location 811; first at line 641, location 640; optimise again or widen the range "
        "[tilt]"
    )


def test_one_finding_has_one_place():
    (cause,) = group_findings([lean(7, 81)])
    assert ", at part.csv:8, location 7; optimise again" in str(cause)


def test_the_worst_may_be_the_first():
    (cause,) = group_findings([lean(7, 82), lean(9, 81)])
    assert ", worst and first at part.csv:8, location 7; optimise" in str(cause)


def test_without_values_the_first_place_is_named():
    found = [Finding(Severity.NOTE, "feed-assumed", "no feed", Place(line=i)) for i in (9, 4, 6)]
    (cause,) = group_findings(found)
    assert str(cause) == "note: feed-assumed (3): no feed, first at line 4 [feed-assumed]"


def test_a_first_place_in_another_file_names_it():
    found = [lean(7, 81), Finding(Severity.ERROR, "tilt", "more", Place(3, 4, "other.csv"), 9.0)]
    (cause,) = group_findings(found)
    assert "worst and first at other.csv:4, location 3" in str(cause)
    (cause,) = group_findings([*found, Finding(Severity.ERROR, "tilt", "less", Place(1, 2, "b.csv"), 0.5)])
    assert "first at b.csv:2, location 1" in str(cause)


def test_severities_and_codes_are_causes_of_their_own_worst_first():
    found = [
        Finding(Severity.NOTE, "axis-creeps", "slow", Place(1)),
        lean(1, 81, Severity.WARNING),
        Finding(Severity.ERROR, "gouge", "deep", Place(3)),
        lean(5, 81),
    ]
    causes = group_findings(found)
    assert [(c.severity, c.code) for c in causes] == [
        ("error", "gouge"),
        ("error", "tilt"),
        ("warning", "tilt"),
        ("note", "axis-creeps"),
    ]


def test_what_has_no_place_is_a_cause_of_its_own():
    found = [Finding(Severity.WARNING, "no-acceleration", f"none of {c}") for c in "XYX"]
    assert [(c.worst.message, c.count) for c in group_findings(found)] == [("none of X", 2), ("none of Y", 1)]


def test_what_is_not_listed_is_counted_with_the_severest_of_its_code():
    found = [lean(1, 81), lean(2, 81), lean(3, 80.1, Severity.WARNING)]
    errors, warnings = group_findings(found, {"tilt": 5000, "gouge": 3})
    assert (errors.count, warnings.count) == (4999, 1)
    # What is listed twice, at a location and in a program's block, counts once.
    assert group_findings([lean(1, 81), lean(2, 81)], {"tilt": 1})[0].count == 1


def test_a_cause_is_plain_data_with_its_line():
    (cause,) = group_findings([lean(7, float("inf"))])
    data = json.loads(json.dumps(cause.as_dict(), allow_nan=False))
    assert list(data) == ["severity", "code", "count", "worst", "first", "text"]
    assert data["text"] == str(cause)
    assert data["worst"]["value"] is None
    assert data["first"] == {"location": 7, "line": 8, "file": "part.csv"}


def test_a_finding_survives_being_plain_data():
    assert Finding.from_dict(json.loads(json.dumps(lean(7, 81).as_dict()))) == lean(7, 81)


@pytest.mark.parametrize("turned", [False, True])
def test_of_findings_that_say_the_same_the_severest_stays(turned):
    found = [lean(7, 81, Severity.WARNING), lean(7, 81), lean(3, 81, Severity.WARNING)]
    assert sort_findings(found[::-1] if turned else found) == (
        lean(7, 81),
        lean(3, 81, Severity.WARNING),
    )
