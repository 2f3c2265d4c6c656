"""Laws of a filled motion on every kind of machine: the tool's centre and axis between given locations."""

from itertools import pairwise

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fiveaxis.check.verification.model import tool_poses
from fiveaxis.model import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    Machine,
    Tool,
    Toolpath,
    across,
    follow,
    interpolate,
    linear_positions,
    load_machine,
    tool_axes,
)
from fiveaxis.model.motion.deviation import WRITTEN_TOLERANCE
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.motion.planes import AxisPlanes
from fiveaxis.model.motion.thinning import thinned

MACHINES = {
    name: load_machine(name)
    for name in ("hayashi-640123", "linuxcnc-xyzac-trt", "linuxcnc-bridgemill", "dmu50ev", "dmu80p-duoblock")
} | {code: Machine.from_code(code) for code in ("012364", "610235", "450123")}
TOOLS = {"ball": Tool.ball(8), "bull": Tool.bull(12, 2), "flat": Tool.flat(8)}
# Places between two blocks at which the machine is looked at, with pinocchio's kinematics.
PLACES = 12
# A block's deviation is a cubic of the way but for this share of it.
CUBIC = 1e-3

turns = st.tuples(st.floats(-25.0, 25.0), st.floats(-15.0, 15.0))
cases = st.tuples(
    st.sampled_from(sorted(MACHINES)),
    st.sampled_from(sorted(TOOLS)),
    st.floats(20.0, 60.0),
    st.lists(turns, min_size=1, max_size=4),
    st.floats(0.2, 5.0),
)


def make(case):
    """Lay a straight cut along which both rotary axes turn by given angles, and choose its planes."""
    name, tool, lean, steps, stride = case
    machine = MACHINES[name]
    rotary = np.radians(np.cumsum([(10.0, lean), *steps], axis=0))
    n = len(rotary)
    contact = np.column_stack([30.0 + stride * np.arange(n), np.zeros(n), np.zeros(n)])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.6, 0.8], (n, 1)), TOOLS[tool])
    assume(np.isfinite(follow(path, machine, rotary).positions).all())
    return machine, path, rotary, AxisPlanes.of(path, machine, rotary)


def deviations(machine, path, positions, share):
    """Measure how far a move's contact is from its chord, and the axis from its plane, at most, mm and rad.

    Rows are blocks at shares of the move, and all axes run linearly from one to the next. The surface is
    flat.
    """
    places = np.linspace(0.0, len(share) - 1.0, PLACES * (len(share) - 1) + 1)
    tip, axis = tool_poses(machine, interpolate(positions, places))
    zone, normal = path.zone, np.tile(path.normal[0], (len(tip), 1))
    contact = tip + zone.height * axis - zone.offset * across(normal, axis) - zone.radius * normal
    way = np.interp(places, np.arange(len(share)), share)[:, None]
    off = np.linalg.norm(contact - (1.0 - way) * contact[0] - way * contact[-1], axis=1)
    return off.max(), out_of_plane(axis, axis[0], axis[-1]).max()


def out_of_plane(axis, first, last):
    """Measure how far unit vectors, (n, 3), are from the plane of two, rad."""
    normal = np.cross(first, last)
    size = np.linalg.norm(normal)
    return np.arcsin(np.minimum(np.abs(axis @ normal) / size, 1.0)) if size > 1e-7 else np.zeros(len(axis))


@given(cases)
def test_between_two_locations_the_tool_keeps_its_way_and_its_plane_or_the_cut_is_named(case):
    machine, path, rotary, planes = make(case)
    _, motion, row = fill_in(path, machine, rotary, planes=planes)
    ends = np.searchsorted(row, np.arange(len(rotary)))
    for move, (first, last) in enumerate(pairwise(ends)):
        span = slice(first, last + 1)
        off, out = deviations(machine, path, motion.positions[span], row[span] - move)
        assert off <= PATH_TOLERANCE * (1.0 + CUBIC)
        assert out <= AXIS_TOLERANCE * (1.0 + CUBIC) or planes.left[move]


@settings(max_examples=40)
@given(cases)
def test_blocks_that_stand_for_several_keep_the_plane_too(case):
    machine, path, rotary, planes = make(case)
    filled, motion, row = fill_in(path, machine, rotary, planes=planes)
    few = thinned(filled, machine, motion, planes=planes.demanded(row))[0]
    given_rows = np.searchsorted(row, np.arange(len(rotary)))
    axes = tool_poses(machine, motion.positions[given_rows])[1]
    for move, (begin, end) in enumerate(pairwise(np.cumsum(motion.time)[given_rows])):
        moments = np.linspace(begin, end, 100)
        positions = [np.interp(moments, np.cumsum(few.time), c) for c in few.positions.T]
        axis = tool_poses(machine, np.stack(positions, axis=1))[1]
        out = out_of_plane(axis, *axes[move : move + 2]).max()
        assert out <= AXIS_TOLERANCE * (1.0 + CUBIC) or planes.left[move]


@settings(max_examples=40)
@given(cases)
def test_half_the_blocks_in_equal_parts_wouldnt_do(case):
    machine, path, rotary, planes = make(case)
    row = fill_in(path, machine, rotary, planes=planes)[2]
    for move, parts in enumerate(np.diff(np.searchsorted(row, np.arange(len(rotary))))):
        fewer = (parts - 1) // 2
        if fewer:
            share = np.linspace(0.0, 1.0, fewer + 1)
            angles = planes.rotary_at(move + share)
            pivot, normal = interpolate(path.pivot, move + share), np.tile(path.normal[0], (fewer + 1, 1))
            tip = path.zone.tip(pivot, normal, tool_axes(machine, angles))
            off, out = deviations(machine, path, linear_positions(machine, tip, angles), share)
            assert off > WRITTEN_TOLERANCE or out > AXIS_TOLERANCE


@settings(max_examples=25)
@given(cases)
def test_given_locations_stay_as_they_are_and_the_same_input_gives_the_same_bytes(case):
    machine, path, rotary, _ = make(case)
    (_, motion, row), (_, again, _) = (fill_in(path, machine, rotary) for _ in range(2))
    assert motion.positions.tobytes() == again.positions.tobytes()
    given_rows = np.searchsorted(row, np.arange(len(rotary)))
    angles = motion.positions[:, machine.rotary_columns]
    np.testing.assert_array_equal(angles[given_rows], rotary)
    # Nothing jumps to another branch or turn.
    turns = np.abs(np.diff(angles, axis=0)).max(axis=1)
    move = np.searchsorted(given_rows, np.arange(1, len(row))) - 1
    most = np.abs(np.diff(rotary, axis=0)).max(axis=1)[move] * np.diff(row)
    assert (turns <= 1.5 * most + 1e-12).all()
