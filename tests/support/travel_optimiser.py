"""`optimise` for what is measured by the travel metric of form-shaping Eq. 1, the paper's objective.

Of a path without a feed that means something the turns are bound per move.
"""

from functools import partial

from support import quick_optimiser

optimise = partial(quick_optimiser.optimise, objective="travel", max_turn=15.0)
find_front = partial(quick_optimiser.find_front, objective="travel", max_turn=15.0)
