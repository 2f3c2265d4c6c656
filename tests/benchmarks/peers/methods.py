"""Methods that choose postures: ours, and what a user would take instead."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
import venv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from case import Case
from scipy.optimize import dual_annealing
from scipy.spatial.transform import Rotation

import fiveaxis as fx
from fiveaxis.motion import follow
from fiveaxis.posture.baselines.catalogue import along_normal, lead_lean
from fiveaxis.posture.local.refinement import refine
from fiveaxis.toolpath import TiltBounds

# rad: steps of the plain lattice.
LATTICE = np.radians([4.0, 6.0])
# Longest path for a search without gradients, and how often it may ask for the cost.
SHORT, EVALUATIONS = 100, 200_000
# s of processor time after which TrajOpt isn't started again.
SECONDS = 100.0
# J per rad, mm or unit of cosine beyond a bound, in that search.
PENALTY = 1e5


class CannotDoError(Exception):
    """Why a method can't do a case."""


Postures = tuple[fx.Toolpath, np.ndarray]


def ours(objective: str, effort: str) -> Callable[[Case], Postures]:
    def run(case: Case) -> Postures:
        around = {"part": case.part, "fixtures": case.fixtures}
        asked = {"objective": objective, "effort": effort, "bound": False}
        found = fx.optimise(case.toolpath, case.machine, **case.options, **around, **asked)
        return found.toolpath, found.motion.positions[:, case.machine.rotary_columns]

    return run


def normal(case: Case) -> Postures:
    """Tool along the normal, leaned up as far as the range asks for."""
    return case.toolpath, along_normal(case.toolpath, case.machine, case.tilt)


def constant_lead_lean(case: Case) -> Postures:
    """The cheapest constant lead and lean, of a grid: what CAM systems offer, chosen well."""
    return case.toolpath, lead_lean(case.toolpath, case.machine, case.tilt)


def ipopt(case: Case) -> Postures:
    """IPOPT on the plain problem, all locations at once, from the constant lead and lean."""
    start = lead_lean(case.toolpath, case.machine, case.tilt)
    found = refine(case.problem, start, iterations=1000, barrier=0.1, solver="ipopt")
    return case.toolpath, found.rotary


def annealing(case: Case) -> Postures:
    """scipy's dual annealing over all angles, with a penalty on what is broken."""
    if len(case.toolpath) > SHORT:
        raise CannotDoError(f"more than {SHORT} locations")
    problem, start = case.problem, along_normal(case.toolpath, case.machine, case.tilt)

    def cost(x: np.ndarray) -> float:
        rotary = x.reshape(-1, 2)
        positions, excess = problem.placed(slice(None), rotary)
        past = np.maximum(np.abs(np.diff(rotary, axis=0)) - problem.max_turn, 0.0).sum()
        past += excess.sum() + problem.limit_excess(positions).sum()
        return float(problem.cost(positions) + PENALTY * past)

    spread = np.pi / 3.0
    bounds = np.stack([start.ravel() - spread, start.ravel() + spread], axis=1)
    found = dual_annealing(cost, bounds, x0=start.ravel(), maxfun=EVALUATIONS, rng=np.random.default_rng(0))
    return case.toolpath, found.x.reshape(-1, 2)


def lattice(case: Case) -> Postures:
    """The cheapest path on a fixed grid of both rotary angles, without refinement."""
    problem, machine = case.problem, case.machine
    columns = machine.rotary_columns
    grids, circle = [], []
    for column, step in zip(columns, LATTICE[::-1], strict=True):
        limits = machine.axes[column].limits
        circle.append(limits.span >= 2.0 * np.pi)
        low, high = (-np.pi, np.pi - step) if circle[-1] else (limits.low, limits.high)
        grids.append(np.arange(low, high + 1e-9, step))
    grid = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 2)
    before: list[np.ndarray] = []
    chosen: list[np.ndarray] = []
    cost = positions = rotary = None
    for i in range(len(problem)):
        there, excess = problem.placed(np.full(len(grid), i), grid)
        admitted = (excess == 0.0) & (problem.limit_excess(there) == 0.0)
        if not admitted.any():
            raise CannotDoError(f"no posture of the grid at location {i}")
        there, angles = there[admitted], grid[admitted]
        if cost is None:
            cost = np.zeros(len(there))
        else:
            cost, back = step_to(case, i - 1, cost, (positions, rotary), (there, angles), circle)
            before.append(back)
        positions, rotary = there, angles
        chosen.append(angles)
    if not np.isfinite(cost).any():
        raise CannotDoError("no path on the grid keeps the largest turns")
    rows = [int(np.argmin(cost))]
    for back in reversed(before):
        rows.append(int(back[rows[-1]]))
    path = np.array([angles[row] for angles, row in zip(chosen, reversed(rows), strict=True)])
    for axis in range(2):
        if circle[axis]:
            path[:, axis] = np.unwrap(path[:, axis])
    return case.toolpath, path


def step_to(case: Case, move: int, cost: np.ndarray, here: tuple, there: tuple, circle: list) -> tuple:
    """Cheapest way from each posture of a location to those of the next one."""
    problem, machine = case.problem, case.machine
    paid = np.repeat(cost[:, None], len(there[0]), axis=1)
    for axis, column in enumerate(machine.rotary_columns):
        turn = there[1][None, :, axis] - here[1][:, None, axis]
        if circle[axis]:
            turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
        paid += np.where(turn > 0.0, problem.plus[move, column], -problem.minus[move, column]) * turn
        if problem.strict[move]:
            paid[np.abs(turn) > problem.max_turn[move, axis] + 1e-9] = np.inf
    for column in machine.linear_columns:
        step = there[0][None, :, column] - here[0][:, None, column]
        paid += np.where(step > 0.0, problem.plus[move, column], -problem.minus[move, column]) * step
    back = paid.argmin(axis=0)
    return paid[back, np.arange(paid.shape[1])], back


def trajopt(case: Case) -> Postures:
    """TrajOpt by tesseract's Python wheel, in an environment of its own, from the constant lead and lean.

    Two virtual joints behind the cutter's centre, a turn about the tool axis and the lean, make the lean
    free; the cost is that of joint velocities, weighted by J/mm and J/rad. It starts anew every 40
    iterations, as the wheel has it, until nothing moves or `SECONDS` are over.
    """
    if len(case.toolpath) > SHORT:
        raise CannotDoError(f"with our settings it converges on short paths only, of {SHORT} locations")
    machine, path, bound = case.machine, case.toolpath, lean_of(case)
    joints = chain_of(case)
    virtual = {"kind": "revolute", "point": joints[-1]["point"]}
    limits = [float(bound.low), float(bound.high)]
    joints.append({"name": "tilt", "direction": [1.0, 0.0, 0.0], "limits": limits} | virtual)
    order = [machine.column(joint.letter) for joint in machine.chain.joints]
    start = follow(path, machine, lead_lean(path, machine, case.tilt)).positions
    # The surface normal, seen from the tool, gives the virtual joints: Rz(spin)·Rx(lean)·z.
    turned = np.tile(np.eye(3), (len(path), 1, 1))
    for joint in machine.chain.joints:
        if joint.is_rotary:
            angle = start[:, machine.column(joint.letter), None] * np.array(joint.line.direction)
            turned = turned @ Rotation.from_rotvec(angle).as_matrix()
    seen = np.einsum("nji,nj->ni", turned, bound.reference)
    spin = np.unwrap(np.arctan2(seen[:, 0], -seen[:, 1]))
    lean = np.arccos(np.clip(seen[:, 2], -1.0, 1.0))
    prices = 0.5 * (case.problem.plus + case.problem.minus).mean(axis=0)
    more = {
        "start": np.column_stack([start[:, order], spin, lean]).tolist(),
        "prices": prices[order].tolist(),
    }
    return path, rotary_of(case, joints, np.array(by_tesseract("trajopt.py", case, joints, more)))


def descartes(case: Case) -> Postures:
    """Descartes by the same wheel: at each of three leans the shortest way through sampled turns.

    Turns about the surface normal are sampled every 6 deg, and joint distance is what it makes short; of the
    three the one with the least travel metric counts. It begins no further lean that would take longer than
    `SECONDS` in all.
    """
    bound, joints = lean_of(case), chain_of(case)
    leans = np.linspace(bound.low, bound.high, 5)[[2, 1, 3]].tolist()
    found = by_tesseract("descartes.py", case, joints, {"leans": leans})
    if not found:
        raise CannotDoError("it finds no way through its samples")
    ways = [rotary_of(case, joints, np.array(values)) for values in found]
    costs = [case.problem.cost(case.problem.positions(slice(None), rotary)) for rotary in ways]
    return case.toolpath, ways[int(np.argmin(costs))]


def lean_of(case: Case) -> TiltBounds:
    """The one range of the lean that tesseract's planners can be given."""
    bound = case.tilt.all[0]
    if len(case.tilt.all) > 1 or not np.isfinite(bound.reference).all():
        raise CannotDoError("takes one range of the lean, at every location")
    return bound


def chain_of(case: Case) -> list[dict]:
    """Joints from the workpiece to the cutter's centre, and a turn about the tool axis there."""
    machine, chain, joints = case.machine, case.machine.chain, []
    point = [0.0, 0.0, 0.0]
    for joint in chain.joints:
        axis = machine.axes[machine.column(joint.letter)]
        if joint.is_rotary:
            point = list(map(float, joint.line.point))
        kind, far = ("revolute", 20.0) if joint.is_rotary else ("prismatic", 1e4)
        limits = [max(axis.limits.low, -far), min(axis.limits.high, far)]
        own = {"name": joint.letter, "kind": kind, "point": point, "limits": limits}
        joints.append(own | {"direction": list(map(float, joint.line.direction))})
    home = chain.tool_home
    if not np.allclose(home[:3, 2], (0.0, 0.0, 1.0)):
        raise CannotDoError("written for a tool along Z at home")
    centre = (home[:3, 3] + case.toolpath.zone.height * home[:3, 2]).tolist()
    spin = {"name": "spin", "kind": "revolute", "point": centre, "limits": [-20.0, 20.0]}
    return [*joints, spin | {"direction": [0.0, 0.0, 1.0]}]


def by_tesseract(script: str, case: Case, joints: list[dict], more: dict) -> list:
    """Run a script with the Python of an environment that has tesseract's wheel."""
    python = environment("tesseract-robotics==0.5.1")
    places = {"points": case.toolpath.pivot.tolist(), "normals": lean_of(case).reference.tolist()}
    problem = {"joints": joints, "seconds": SECONDS} | places | more
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder) / "problem.json", Path(folder) / "result.json"
        given.write_text(json.dumps(problem), encoding="utf-8")
        command = [python, Path(__file__).with_name(script), given, found]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode != 0:
            raise CannotDoError((run.stderr.strip().splitlines() or ["it ended without a word"])[-1])
        return json.loads(found.read_text(encoding="utf-8"))


def rotary_of(case: Case, joints: list[dict], values: np.ndarray) -> np.ndarray:
    """Rotary angles, (n, 2) rad, of joint values."""
    names, machine = [joint["name"] for joint in joints], case.machine
    return values[:, [names.index(machine.letters[c]) for c in machine.rotary_columns]]


def environment(package: str) -> Path:
    """Python of an environment that has a package; made at first use."""
    folder = Path(tempfile.gettempdir()) / "fiveaxis-peers-environments" / package.replace("==", "-")
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        made = subprocess.run(
            [python, "-m", "pip", "install", "-q", package], capture_output=True, text=True, check=False
        )
        if made.returncode != 0:
            shutil.rmtree(folder)
            raise CannotDoError(f"{package} can't be installed: {made.stderr.strip().splitlines()[-1]}")
    return python


# No method, but what none can be better than.
BOUND = "lower bound"

METHODS: dict[str, Callable[[Case], Postures]] = {
    "fiveaxis, energy, normal": ours("energy", "normal"),
    "fiveaxis, energy, quick": ours("energy", "quick"),
    "fiveaxis, travel, normal": ours("travel", "normal"),
    "fiveaxis, travel, quick": ours("travel", "quick"),
    "IPOPT": ipopt,
    "lattice": lattice,
    "dual annealing": annealing,
    "TrajOpt": trajopt,
    "Descartes": descartes,
    "lead and lean": constant_lead_lean,
    "normal": normal,
}


def axis_values(case: Case, postures: Postures) -> np.ndarray:
    """Axis values, (n, k) mm and rad, at the given locations of what a method chose."""
    path, rotary = postures
    given = ~path.inserted if len(path) != len(case.toolpath) else slice(None)
    return follow(path, case.machine, rotary).positions[given]
