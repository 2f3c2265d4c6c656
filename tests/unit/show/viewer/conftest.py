"""A small solution to show."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from support.quick_optimiser import tilt_bounds

from fiveaxis.base import Workpiece
from fiveaxis.check import Surroundings
from fiveaxis.check.stock.cutting import cut_stock
from fiveaxis.model import (
    MoveKind,
    Tool,
    Toolpath,
    follow,
    interpolate,
    motion_energy,
    rotary_angles,
    tool_poses,
)
from fiveaxis.posture.solution import Baseline, Optimum
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside

N = 240
RESOLUTION = 1.0  # mm, of the stock
RADIUS, HEIGHT = 40.0, 30.0


def ring_path() -> Toolpath:
    """One turn around a cylinder's wall, with a link in the middle."""
    angle = np.linspace(0.0, 2.0 * np.pi, N)
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros(N)], axis=1)
    path = Toolpath.from_contacts(
        RADIUS * normal, normal, Tool.ball(10.0), name="/some/folder/<ring> & co.csv"
    )
    kind = path.kind.copy()
    kind[N // 2] = MoveKind.LINK
    return replace(path, kind=kind)


def tilted(path: Toolpath, degrees: np.ndarray) -> np.ndarray:
    angle = np.radians(degrees)[:, None]
    return np.cos(angle) * path.normal + np.sin(angle) * np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="session")
def solution(hayashi) -> Optimum:
    """A result that swings, and rests for a while, beside a baseline that swings more often."""
    path = ring_path()
    found, turn = {}, np.linspace(0.0, 2.0 * np.pi, N)
    swings = {"result": 20.0 + 3.0 * np.sin(3.0 * turn).clip(0.0), "normal": 60.0 + 2.0 * np.sin(5.0 * turn)}
    for name, degrees in swings.items():
        rotary = np.unwrap(rotary_angles(hayashi, tilted(path, degrees))[1], axis=0)
        motion = follow(path, hayashi, rotary)
        found[name] = Baseline(motion, motion_energy(hayashi, motion))
    return Optimum(
        machine=hayashi,
        toolpath=path,
        tilt=tilt_bounds(path, tilt=(15, 75)),
        motion=found["result"].motion,
        energy=found["result"].energy,
        compared={"normal": found["normal"]},
        missing={},
        stages=(),
    )


@pytest.fixture(scope="session")
def part() -> trimesh.Trimesh:
    return trimesh.creation.cylinder(radius=RADIUS, height=HEIGHT, sections=90)


@pytest.fixture(scope="session")
def stocked(part) -> Surroundings:
    return Surroundings.of(Workpiece(part=part, stock="part+2", stock_resolution=RESOLUTION))


@pytest.fixture(scope="session")
def cut_program(solution, stocked):
    """A program as verified: its rows are the path's, and the stock is cut along them."""
    positions, machine = solution.motion.positions, solution.machine

    def poses(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return tool_poses(machine, interpolate(positions, place))

    rows = np.arange(1, len(positions))
    cut = cut_stock(stocked.blank, solution.toolpath.tool, poses, rows, len(positions))
    return SimpleNamespace(
        fill=None, motion=None, text=SimpleNamespace(lines=()), report=SimpleNamespace(cut=cut, standing=None)
    )


@pytest.fixture(scope="session")
def stock_page(solution, stocked, cut_program) -> str:
    return render_page(solution, Beside(program=cut_program, surroundings=stocked))
