"""The bound on the path between two samples, on any machine."""

import numpy as np
import pytest
from support.pairwise_cases import in_pairs

from fiveaxis.base import translation
from fiveaxis.check.collision.pieces import box_piece
from fiveaxis.check.collision.travel import Stretch, Travel
from fiveaxis.model import Machine, link_poses
from fiveaxis.model.machine.axes import Axis
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import parse_code

SHARES = np.linspace(0.0, 1.0, 33)
OFFSETS = {"A": Line((1.0, 0.0, 0.0), (0.0, 20.0, 10.0)), "C": Line((0.0, 0.1, 1.0), (5.0, -6.0, 7.0))}


def machine_of(code: str) -> Machine:
    parsed = parse_code(code)
    lines = {letter: line for letter, line in OFFSETS.items() if letter in parsed.letters}
    chain = Chain.from_code(parsed, lines)
    return Machine(code, parsed, chain, tuple(Axis(c) for c in sorted(parsed.letters, key="XYZABC".index)))


def travel_of(machine: Machine, ends: tuple[int, int], turn: float) -> Travel:
    rng = np.random.default_rng(5)
    scale = np.array([turn if a.is_rotary else 30.0 for a in machine.axes])
    positions = rng.uniform(-1.0, 1.0, (40, len(scale))) * scale
    links = machine.code.links
    mover = box_piece(np.array([10.0, 20.0, 30.0]), translation((3.0, -40.0, 25.0)))
    other = box_piece(np.array([50.0, 50.0, 50.0]), translation((9.0, 8.0, 7.0)))
    stretch = Stretch(machine, lambda q: link_poses(machine, q), positions)
    return Travel(stretch, mover, other, links[ends[0]], links[ends[1]])


@in_pairs(
    code=["640123", "640231", "012364", "610235", "641023"],
    ends=[(0, -1), (-1, 0), (1, -2), (-1, 2)],
    turn=[0.05, 1.0, 4.0],
)
def test_no_point_leaves_its_chord_by_more_than_an_eighth_of_the_bend(code, ends, turn):
    travel = travel_of(machine_of(code), ends, turn)
    moves = np.arange(39)
    for share in SHARES:
        corners = travel.corners_at(travel.between(moves, np.full(39, share)))
        chord = travel.corners[:-1] + share * (travel.corners[1:] - travel.corners[:-1])
        away = np.linalg.norm(corners - chord, axis=2).max(axis=1)
        assert (away <= travel.bends / 8.0 + 1e-9).all()


def test_the_bend_of_one_rotary_axis_is_nearly_exact():
    machine = machine_of("640123")
    positions = np.zeros((2, 5))
    positions[1, machine.column("C")] = 0.2
    far = box_piece(np.full(3, 1e-3), translation((100.0, 0.0, 0.0)))
    stretch = Stretch(machine, lambda q: link_poses(machine, q), positions)
    travel = Travel(stretch, far, far, "Z", "C")
    middle = travel.corners_at(travel.middles(np.array([0])))
    away = np.linalg.norm(middle - (travel.corners[:1] + travel.corners[1:]) / 2.0, axis=2).max()
    assert away == pytest.approx(float(travel.bends[0]) / 8.0, rel=0.01)


def test_linear_axes_alone_bend_nothing():
    travel = travel_of(machine_of("640123"), (0, -1), 0.0)
    assert travel.bends.tolist() == [0.0] * 39
