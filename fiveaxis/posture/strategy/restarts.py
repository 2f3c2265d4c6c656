"""Many starts: the spread of their local optima shows how good the best path is, though it proves nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.posture.baselines import INSIDE, NoBaseline, follow_axes, uphill
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Optima
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.portfolio import Portfolio
from fiveaxis.toolpath import TiltBounds, Toolpath

# Name of the portfolio's own start.
OWN = "searches"


def best_of_starts(
    run: Portfolio, compared: Mapping[str, Baseline], leaning: Mapping[str, Array]
) -> tuple[Array, Optima]:
    """Find the cheapest admissible path from all starts of the effort.

    The portfolio's own searches come first, so the result is never costlier than without the other starts.

    Parameters
    ----------
    run : the portfolio; the stages of the other starts are added to its own
    compared : the baselines
    leaning : further starts by name, (n, 2) rad (`leaning_paths`)

    Returns
    -------
    The path, (n, 2) rad, and the spread of what was found.

    Raises
    ------
    Infeasible
        No start leads to a path.
    """
    problem, effort = run.problem, run.effort
    found = {OWN: _searched(run, compared)}
    for number, searches in enumerate(effort.others, start=1):
        name = f"{OWN}, set {number}"
        other = Portfolio(problem, replace(effort, searches=searches), run.progress)
        found[name] = _searched(other, {})
        run.stages += [replace(stage, name=f"{name}: {stage.name}") for stage in other.stages]
    columns = problem.machine.rotary_columns
    own = {f"baseline {name}": b.motion.positions[:, columns] for name, b in compared.items()}
    for name, start in ({**own, **leaning} if effort.from_baselines else leaning).items():
        found[name] = run.refined_from(name, start)
    return _cheapest(problem, found)


def leaning_paths(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, effort: Effort) -> dict[str, Array]:
    """Compute paths with a constant upward lean, (n, 2) rad, of those angles that the limits allow."""
    paths = {}
    upwards = uphill(tilt.reference, machine.chain.tool_home[:3, 2])
    for share in effort.leans:
        angle = (1.0 - share) * (tilt.low + INSIDE) + share * (tilt.high - INSIDE)
        axis = np.cos(angle) * tilt.reference + np.sin(angle) * upwards
        try:
            paths[f"lean of {np.degrees(angle):.3g} deg"] = follow_axes(toolpath, machine, axis)
        except NoBaseline:
            continue
    return paths


def _searched(run: Portfolio, compared: Mapping[str, Baseline]) -> Array | Infeasible:
    try:
        return run.best_path(compared)
    except Infeasible as reason:
        return reason


def _cheapest(problem: Problem, found: Mapping[str, Array | Infeasible]) -> tuple[Array, Optima]:
    paths = {name: path for name, path in found.items() if not isinstance(path, Infeasible)}
    sound = {n: problem.path_cost(path) for n, path in paths.items() if problem.violation(path) <= ALLOWED}
    optima = Optima(sound, tuple(name for name in found if name not in sound))
    if sound:
        return paths[min(sound, key=lambda name: sound[name])], optima
    # If no path is admissible, the portfolio's own shows why.
    first = found[OWN]
    if isinstance(first, Infeasible):
        raise first
    return first, optima
