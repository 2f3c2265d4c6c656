"""Laws of the thinned motion, for every machine: on its way, in time, and the same each time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.driven_motion import driven

from fiveaxis.base import angle_between
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.model import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    MoveKind,
    Tool,
    Toolpath,
    linear_positions,
    load_machine,
    tool_axes,
)
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.motion.thinning import thinned

MACHINES = ("hayashi-640123", "linuxcnc-xyzac-trt", "linuxcnc-bridgemill", "dmu50ev", "dmu80p-duoblock")
# Moments within each given block at which the two motions are compared.
SHARES = np.linspace(0.0, 1.0, 8)[1:]
ROUNDING = 1e-8

waves = st.tuples(st.floats(0.0, 0.4), st.floats(0.0, 3.0), st.floats(0.0, 0.3), st.floats(-0.3, 0.3))
cases = st.tuples(st.sampled_from(MACHINES), waves, st.booleans(), st.integers(3, 150))


def make(case):
    """Lay a wave with a link in its middle, and angles that turn along it."""
    name, (height, turns, turn, rise), tcp, n = case
    machine = load_machine(name)
    along = np.linspace(0.0, 1.0, n)
    contact = np.column_stack([30.0 * along, 5.0 * np.sin(turns * along), height * along])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(8))
    links = (along > 0.4) & (along < 0.5)
    path = replace(path.with_links(links), feed=np.where(links, 2.0 * path.feed, path.feed))
    rotary = np.column_stack([0.4 + turn * np.sin(3.0 * along), -0.5 + rise * along])
    filled, motion, _ = fill_in(path, machine, rotary, tcp=tcp)
    return machine, filled, motion, tcp


def sampled(machine, motion, tcp, moments):
    """Give tip and tool axis of a control that drives a motion, by kinematics of verification's own."""
    clock = np.cumsum(motion.time)
    positions = np.stack([np.interp(moments, clock, c) for c in motion.positions.T], axis=1)
    if tcp:
        tips = tool_poses(machine, motion.positions)[0]
        tip = np.stack([np.interp(moments, clock, c) for c in tips.T], axis=1)
        positions = linear_positions(machine, tip, positions[:, machine.rotary_columns])
    return tool_poses(machine, positions)


def beside(path, row, centre):
    """Measure how far points are from where they may be at rows: between the path's curve and its chord."""
    if path.curve is None:
        chord = np.stack([np.interp(row, np.arange(len(path)), c) for c in path.pivot.T], axis=1)
        return np.linalg.norm(centre - chord, axis=1)
    curve, across = path.curve.between(path.pivot, row)
    long = np.maximum((across**2).sum(axis=1), 1e-300)
    share = np.clip(((centre - curve) * across).sum(axis=1) / long, 0.0, 1.0)
    return np.linalg.norm(centre - curve - share[:, None] * across, axis=1)


@settings(max_examples=40)
@given(cases)
@example(("hayashi-640123", (0.0, 1.0, 0.25, 0.0), False, 4))
def test_the_centre_is_where_the_path_has_it_at_every_moment(case):
    machine, path, motion, tcp = make(case)
    few, _ = thinned(path, machine, motion, tcp=tcp)
    clock = np.cumsum(motion.time)
    moments = (clock[:-1, None] + SHARES * np.diff(clock)[:, None]).ravel()
    tip, axis = sampled(machine, few, tcp, moments)
    centre = tip + path.zone.height * axis
    assert beside(path, np.interp(moments, clock, np.arange(len(clock))), centre).max() <= (
        PATH_TOLERANCE + ROUNDING
    )
    angles = np.stack([np.interp(moments, clock, c) for c in motion.positions.T], axis=1)
    given_axis = tool_axes(machine, angles[:, machine.rotary_columns])
    assert angle_between(axis, given_axis).max() <= AXIS_TOLERANCE + ROUNDING


@settings(max_examples=25)
@given(cases)
def test_kept_rows_are_the_given_ones_and_times_add_up(case):
    machine, path, motion, tcp = make(case)
    few, kept = thinned(path, machine, motion, tcp=tcp)
    assert kept[0] == 0
    assert kept[-1] == len(motion) - 1
    np.testing.assert_array_equal(few.positions, motion.positions[kept])
    np.testing.assert_allclose(np.cumsum(few.time), np.cumsum(motion.time)[kept], rtol=1e-12)
    # Every change of kind is where it was.
    for kind in MoveKind:
        way = path.lengths[motion.kind == kind].sum()
        shorter = path.at(kept)
        assert shorter.lengths[few.kind == kind].sum() == pytest.approx(way, rel=1e-3, abs=1e-9)


@settings(max_examples=20)
@given(cases)
def test_no_axis_travels_farther_for_fewer_blocks(case):
    machine, path, motion, tcp = make(case)
    _, kept = thinned(path, machine, motion, tcp=tcp)
    before, after = (np.abs(m.moves).sum(axis=0) for m in (motion, driven(machine, motion, kept, tcp)))
    assert (after <= before + 1e-6 * len(motion)).all()


@settings(max_examples=20)
@given(cases)
def test_what_is_kept_of_a_motion_is_kept_when_its_needless_rows_are_sought_again(case):
    machine, path, motion, tcp = make(case)
    _, kept = thinned(path, machine, motion, tcp=tcp)
    needed = np.isin(np.arange(len(motion)), kept)
    _, again = thinned(path, machine, motion, tcp=tcp, needed=needed)
    np.testing.assert_array_equal(again, kept)
