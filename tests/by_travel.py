"""`optimise` for what is measured by the travel metric of form-shaping Eq. 1, the paper's objective.

Of a path without a feed that means something the turns are bound per move.
"""

from functools import partial

import by_degrees

from fiveaxis import posture

optimise = partial(by_degrees.optimise, objective="travel", max_turn=15.0)
find_front = partial(by_degrees.find_front, objective="travel", max_turn=15.0)


def refined_cost(solution: posture.Solution) -> float:
    """Return the objective at the given locations, J, before any were inserted."""
    return next(stage.after for stage in reversed(solution.stages) if stage.name.startswith("refine"))
