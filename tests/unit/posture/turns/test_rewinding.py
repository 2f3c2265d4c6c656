"""Rewinds of an axis with one turn or little more: at the turn change, and no more than necessary."""

import itertools
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds
from support.travel_optimiser import optimise

from fiveaxis.base import Array, angle_between
from fiveaxis.base.errors import Infeasible
from fiveaxis.base.findings import Severity
from fiveaxis.check import verify
from fiveaxis.model import (
    Limits,
    Machine,
    TiltBounds,
    Tool,
    Toolpath,
    follow,
    tool_axes,
    tool_poses,
    within_limits,
)
from fiveaxis.model.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.nc import compose_program
from fiveaxis.posture import Optimum
from fiveaxis.posture.turns.rewinding import insert_rewinds, plan_turns, winding_columns
from fiveaxis.posture.turns.stops import find_stops, with_turn_changes

RANGES = [(-180.0, 180.0), (0.0, 360.0), (-10.0, 352.0), (-100.0, 300.0)]


def ranged(machine: Machine, low: float, high: float) -> Machine:
    """The machine with C from one angle to another, deg."""
    limits = Limits(np.radians(low), np.radians(high))
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    return replace(machine, axes=axes)


def turns_round(turns: float, per_turn: int, *, first: float = 0.0, links: int = 0) -> tuple[Toolpath, Array]:
    """Turns round a cylinder from C at an angle, deg; so many locations before each turn's end are links."""
    n = int(turns * per_turn) + 1
    angle = np.radians(first) + np.arange(n) * TURN / per_turn
    around = angle + np.pi / 2.0
    normal = np.stack([np.cos(around), np.sin(around), np.zeros(n)], axis=1)
    contact = 20.0 * normal + np.outer(np.arange(n) * 0.05, [0.0, 0.0, 1.0])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6), feed_mm_min=600.0)
    air = (np.arange(n) % per_turn >= per_turn - links) & (links > 0)
    path = path.with_links(air)
    path = replace(path, pivot=path.pivot + np.where(air[:, None], 60.0 * normal, 0.0))
    return path, np.stack([angle, np.full(n, np.radians(-45.0))], axis=1)


def least_of_all(path: Toolpath, machine: Machine, rotary: Array) -> float:
    """Least price over every choice of turns after each location and each turn change."""
    column = machine.column("C")
    limits = machine.axes[column].limits
    course = with_turn_changes(path, machine, rotary, [column])
    stop_price, turn_price, _ = find_stops(course, machine, column, 0.0)
    angles = course.rotary[:, 0]
    every = np.arange(-9, 10)
    unwrapped = angles[:, None] + TURN * every
    fits = (unwrapped >= limits.low - ON_LIMIT) & (unwrapped <= limits.high + ON_LIMIT)
    best = np.inf
    for turns in itertools.product(*(every[row] for row in fits)):
        price = 0.0
        for i, (came, left) in enumerate(itertools.pairwise(turns), start=1):
            if came == left:
                continue
            if not fits[i, every == came].any():
                price = np.inf
                break
            one = turn_price[0] if left > came else turn_price[1]
            price += stop_price[i] + abs(left - came) * one
        best = min(best, price)
    return best


def price_of(path: Toolpath, machine: Machine, rotary: Array) -> float:
    found = insert_rewinds(path, machine, rotary)
    return found.energy + 1e9 * sum(r.in_cut for r in found.rewinds)


@pytest.mark.parametrize(("low", "high"), RANGES)
@pytest.mark.parametrize(("first", "links"), [(0.0, 0), (-70.0, 1), (100.0, 3), (180.0, 2)])
def test_no_choice_of_turns_is_cheaper_than_the_plan(hayashi, low, high, first, links):
    machine = ranged(hayashi, low, high)
    path, rotary = turns_round(2.5, 8, first=first, links=links)
    assert price_of(path, machine, rotary) == pytest.approx(least_of_all(path, machine, rotary), rel=1e-12)


@pytest.mark.parametrize(("first", "needed"), [(0.0, 2), (40.0, 3), (-40.0, 3)])
def test_three_turns_on_an_axis_of_one_need_two_rewinds_from_its_end_and_three_from_elsewhere(
    hayashi, first, needed
):
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = turns_round(3, 36, first=first)
    found = insert_rewinds(path, machine, rotary)
    assert [r.turns for r in found.rewinds] == [-1] * needed
    assert winding_columns(machine) == [machine.column("C")]


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_limits_are_kept_and_the_path_too(hayashi, low, high):
    machine = ranged(hayashi, low, high)
    path, rotary = turns_round(3.2, 20, first=33.0)
    found = insert_rewinds(path, machine, rotary)
    motion = follow(found.toolpath, machine, found.rotary)
    assert within_limits(machine, motion.positions).all()
    np.testing.assert_array_equal(found.row[found.own], np.arange(len(path)))
    np.testing.assert_array_equal(found.toolpath.pivot[found.own], path.pivot)
    # What was inserted into a cut lies on the cut.
    cut = found.toolpath.cutting & ~found.own
    assert cut.any() == (high - low < 360.0 + 18.0)
    line = np.array([np.interp(found.row, np.arange(len(path)), c) for c in path.pivot.T]).T
    np.testing.assert_allclose(found.toolpath.pivot[cut], line[cut], atol=1e-12)
    tip, axis = tool_poses(machine, motion.positions)
    np.testing.assert_allclose((tip + 3.0 * axis)[cut], line[cut], atol=1e-9)
    # Between locations too, with the blocks that keep the contact between them.
    _, driven, _ = fill_in(found.toolpath, machine, found.rotary)
    assert within_limits(machine, driven.positions).all()


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_the_program_of_a_rewound_path_stays_within_the_limits(hayashi, low, high):
    machine = ranged(hayashi, low, high)
    path, rotary = turns_round(3.2, 20, first=33.0)
    found = insert_rewinds(path, machine, rotary)
    text = compose_program(follow(found.toolpath, machine, found.rotary), machine=machine).text
    words = [float(word) for word in re.findall(r"(?<=C)-?\d+\.?\d*", re.sub(r"\(.*?\)", "", text))]
    assert len(words) > 60
    assert min(words) >= low - 1e-9
    assert max(words) <= high + 1e-9
    assert max(words) - min(words) > 350.0


def test_the_tool_backs_off_at_the_turn_change_and_the_finding_names_it(hayashi):
    machine = ranged(hayashi, -180.0, 180.0)
    path, rotary = turns_round(1.5, 35, first=-100.0)
    found = insert_rewinds(path, machine, rotary)
    [rewind], [finding] = found.rewinds, found.findings()
    assert rewind.in_cut
    assert rewind.row != round(rewind.row)
    assert (finding.code, finding.severity) == ("rewind", Severity.WARNING)
    row = finding.place.location
    # Cut to the turn change, back off, turn, return, cut on.
    assert found.toolpath.cutting[row : row + 5].tolist() == [True, False, False, False, True]
    c = np.degrees(found.rotary[row : row + 4, 0])
    np.testing.assert_allclose(c, [180.0, 180.0, -180.0, -180.0], atol=1e-9)
    gone = np.linalg.norm(found.toolpath.pivot[row + 1] - found.toolpath.pivot[row])
    assert gone == pytest.approx(rewind.retract)


def test_every_inserted_location_is_a_stop(hayashi):
    """C passes 170…190 deg in steps of 50 deg, sometimes without a location there."""
    machine = ranged(hayashi, -190.0, 190.0)
    path, rotary = turns_round(3.0, 7, first=10.0)
    rotary[:, 0] = np.radians(10.0 + 50.0 * np.arange(len(path)))
    course = with_turn_changes(path, machine, rotary, [machine.column("C")])
    found = insert_rewinds(path, machine, rotary)
    assert 0 < (~course.own).sum() < len(found.rewinds)
    assert set(course.row[~course.own]) <= {r.row for r in found.rewinds}


def test_bounds_on_the_lean_bind_in_cuts_and_not_on_the_retract(hayashi):
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = turns_round(2.3, 30, first=7.0)
    tilt = tilt_bounds(path, tilt=(10, 80))
    found = insert_rewinds(path, machine, rotary, tilt=tilt)
    bounds = found.bounds(tilt)
    np.testing.assert_array_equal(bounds.reference[found.own], path.normal)
    np.testing.assert_array_equal(np.isfinite(bounds.reference).all(axis=1), found.toolpath.cutting)
    np.testing.assert_array_equal(
        bounds.reference[found.toolpath.cutting], found.toolpath.normal[found.toolpath.cutting]
    )
    assert bounds.admits(tool_axes(machine, found.rotary)).all()


def test_no_rewind_takes_place_where_no_posture_at_the_turn_change_keeps_the_bounds(hayashi):
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = turns_round(1.3, 30, first=7.0)
    axis = tool_axes(machine, rotary)
    # A cone about programmed axes that lean far to both sides of the turn change alternately.
    aside = np.where(np.arange(len(path)) % 2, 1.0, -1.0)[:, None] * np.cross(path.normal, [0.0, 0.0, 1.0])
    reference = axis + 0.5 * aside
    reference /= np.linalg.norm(reference, axis=1, keepdims=True)
    angles = angle_between(axis, reference)
    bounds = TiltBounds(reference, float(angles.min()) - 1e-6, float(angles.max()) + 1e-6, "programmed axis")
    assert bounds.admits(axis).all()
    with pytest.raises(Infeasible, match=r"C from [\d.]+ to [\d.]+ deg would be enough"):
        insert_rewinds(path, machine, rotary, tilt=bounds)


def test_there_is_no_stop_at_a_turn_change_beyond_a_linear_limit(hayashi):
    """Near C = 180 deg the contact lies farthest along −Y; a limit there leaves no room to back off."""
    machine = ranged(hayashi, -180.0, 180.0)
    path, rotary = turns_round(1.5, 36, first=-105.0)
    positions = follow(path, machine, rotary).positions
    z = machine.column("Z")
    tight = replace(
        machine,
        axes=tuple(
            replace(a, limits=Limits(a.limits.low, float(positions[:, z].max()) + 1.0))
            if a.letter == "Z"
            else a
            for a in machine.axes
        ),
    )
    with pytest.raises(
        Infeasible, match=r"Z to \d+(\.\d)? mm or C from -?[\d.]+ to -?[\d.]+ deg would be enough"
    ) as e:
        insert_rewinds(path, tight, rotary)
    [finding] = e.value.findings
    assert finding.code == "no-rewind"
    z_high, c_low, c_high = map(
        float, re.search(r"Z to ([\d.]+) mm or C from (-?[\d.]+) to (-?[\d.]+)", str(e.value)).groups()
    )

    def with_z(high: float) -> Machine:
        limits = Limits(tight.axis("Z").limits.low, high)
        return replace(
            tight, axes=tuple(replace(a, limits=limits) if a.letter == "Z" else a for a in tight.axes)
        )

    # The suggested limits are enough, and hardly less is not.
    assert len(insert_rewinds(path, with_z(z_high), rotary).rewinds) == 1
    with pytest.raises(Infeasible):
        insert_rewinds(path, with_z(z_high - 0.2), rotary)
    assert insert_rewinds(path, ranged(tight, c_low, c_high), rotary).rewinds == ()
    with pytest.raises(Infeasible):
        insert_rewinds(path, ranged(tight, c_low, c_high - 0.2), rotary)


def test_an_axis_of_one_turn_cannot_rewind_at_locations_alone(hayashi):
    """A plan over the locations, without turn changes, doesn't exist."""
    path, rotary = turns_round(2.0, 30, first=5.0)
    assert plan_turns(rotary[:, 0], Limits(0.0, TURN), np.zeros(len(path))) is None
    assert len(insert_rewinds(path, ranged(hayashi, 0.0, 360.0), rotary).rewinds) == 2


@pytest.fixture(scope="module")
def helix(hayashi):
    """Solve the helix of 1.6 turns on a machine with C from one angle to another, deg."""

    @cache
    def solved(low: float, high: float) -> Optimum:
        path, _ = turns_round(1.6, 36)
        return optimise(path, ranged(hayashi, low, high), tilt=(15, 75))

    return solved


@pytest.mark.parametrize(("low", "high"), [(-180.0, 180.0), pytest.param(0.0, 360.0, marks=pytest.mark.slow)])
def test_a_helix_on_an_axis_of_one_turn_is_optimised(helix, low, high):
    solution = helix(low, high)
    machine = solution.machine
    residuals = solution.residuals()
    assert max(residuals["tilt"], residuals["limit"], residuals["contact"]) <= 1e-9
    rewinds = [f for f in solution.toolpath.findings if f.code == "rewind"]
    assert 1 <= len(rewinds) <= 2
    c = machine.column("C")
    turned = np.abs(solution.motion.moves[:, c])
    assert (turned > TURN - 1e-6).sum() == len(rewinds)
    assert turned[solution.motion.cutting].max() <= np.radians(15.0) + 1e-9


def ahead_of_normal(normal: Array, c: Array) -> Array:
    """How far C is ahead of where it follows the normal, deg."""
    follows = np.arctan2(normal[:, 1], normal[:, 0]) - np.pi / 2.0
    return np.degrees(np.mod(c - follows + np.pi, TURN) - np.pi)


@pytest.mark.slow
def test_a_mask_holds_on_a_path_that_is_rewound(hayashi, helix):
    machine = ranged(hayashi, 0.0, 360.0)
    path, _ = turns_round(1.6, 36)
    seen: list[float] = []

    def mask(rows: Array, rotary: Array) -> Array:
        seen.extend(rotary[:, 0])
        return np.asarray(ahead_of_normal(path.normal[rows], rotary[:, 0]) >= 10.0)

    solution = optimise(path, machine, tilt=(15, 75), mask=mask)
    # It was never called for a turn that the machine hasn't got.
    assert -1e-6 <= min(seen) <= max(seen) <= TURN + 1e-6
    assert [f for f in solution.toolpath.findings if f.code == "rewind"]
    assert solution.residuals()["limit"] <= 1e-9
    assert solution.unwrapped is not None
    cuts = solution.toolpath.cutting & ~solution.toolpath.inserted
    c = solution.motion.positions[cuts, machine.column("C")]
    assert ahead_of_normal(solution.toolpath.normal[cuts], c).min() >= 10.0
    # Without the mask C follows the normal, and so does the path that is drawn in.
    free = helix(0.0, 360.0)
    assert free.unwrapped is not None
    assert ahead_of_normal(free.unwrapped.toolpath.normal, free.unwrapped.rotary[:, 0]).min() < 5.0


def test_a_solution_has_the_path_that_it_was_rewound_from(helix):
    solution = helix(-180.0, 180.0)
    machine, unwrapped = solution.machine, solution.unwrapped
    assert unwrapped is not None
    assert unwrapped.problem.violation(unwrapped.rotary) <= 1e-9
    again = insert_rewinds(unwrapped.toolpath, machine, unwrapped.rotary)
    np.testing.assert_array_equal(again.rotary, solution.motion.positions[:, machine.rotary_columns])


def test_verification_finds_nothing_wrong_with_a_rewound_path(hayashi, helix):
    solution = helix(0.0, 360.0)
    report = verify(solution.motion, solution.machine, solution.toolpath, tilt=(15, 75))
    wrong = [f for f in report.findings if f.severity is Severity.ERROR]
    assert wrong == []
    # The same motion on a machine with a little less of C is refused.
    less = verify(solution.motion, ranged(hayashi, 1.0, 360.0), solution.toolpath, tilt=(15, 75))
    assert "axis-limit" in {f.code for f in less.findings}
