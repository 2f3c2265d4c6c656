"""Small problems, each with one term at work at its optimum."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import for_tilt, tilt_bounds

from fiveaxis.model import Limits, Machine, Tool, Toolpath, load_machine
from fiveaxis.posture.problem import Problem

N = 40
TILT = (15.0, 75.0)
# mm/s and rad/s, slow enough to matter.
SPEEDS = np.array([3.0, 3.0, 1.5, 0.2, 0.3])
CASES = (
    "free",
    "limited",
    "slow turns",
    "bends",
    "link",
    "timed",
    "accelerations",
    "bull nose",
    "rotary between",
    "held axis",
    "held turns",
)


def with_limits(machine: Machine, **limits: Limits) -> Machine:
    """The machine with other ends of some axes."""
    return replace(
        machine, axes=tuple(replace(a, limits=limits.get(a.letter, a.limits)) for a in machine.axes)
    )


def path_of(tool: Tool) -> Toolpath:
    """Contacts round part of a cone that leans outwards."""
    angle = np.linspace(0.0, 4.0, N)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(N, -0.3)], axis=1)
    contact = np.stack([20 * np.cos(angle), 15 * np.sin(angle), np.full(N, 10.0)], axis=1)
    return for_tilt(Toolpath.from_contacts(contact, normal, tool), TILT, None)


def problem_of(case: str) -> Problem:
    """The problem of a name in `CASES`."""
    machine = load_machine("hayashi-640123")
    path = path_of(Tool.bull(6.0, 1.0) if case == "bull nose" else Tool.ball(6.0))
    options = {}
    if case == "link":
        path = path.with_links(np.arange(N) // 4 == 3)
    if case == "limited":
        ends = Limits(np.radians(-70.0), np.radians(20.0))
        machine = with_limits(machine, X=Limits(-14.0, 60.0), A=ends)
    if case == "slow turns":
        options["max_turn"] = np.radians(6.5)
    if case == "bends":
        options["bend_price"] = 3000.0
    if case == "rotary between":
        machine = replace(Machine.from_code("624013"), axes=machine.axes)
    if case == "held axis":
        angle = np.radians(-66.0)
        machine = with_limits(machine, A=Limits(angle, angle))
    problem = Problem.build(path, machine, tilt_bounds(path, TILT), **options)
    if case == "timed":
        return replace(problem, top_speed=SPEEDS, time_price=300.0)
    if case == "accelerations":
        return replace(problem, top_acceleration=np.array([1.5, 1.5, 1.5, 0.3, 0.2]))
    if case == "held turns":
        turns = problem.max_turn.copy()
        turns[12:20, 0] = 0.0
        return replace(problem, max_turn=turns)
    return problem


@pytest.fixture(params=CASES)
def problem(request) -> Problem:
    return problem_of(request.param)


@pytest.fixture
def start() -> np.ndarray:
    """Follow the normals, tool tilted up, with a wobble."""
    turn = np.linspace(0.0, 4.0, N) - np.pi / 2.0
    wobble = 0.005 * np.random.default_rng(3).standard_normal((N, 2))
    return np.stack([turn, np.full(N, np.radians(-66.0))], axis=1) + wobble
