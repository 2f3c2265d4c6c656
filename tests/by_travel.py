"""`optimise` for what is measured by the travel metric of form-shaping Eq. 1, the paper's objective.

Of a path without a feed that means something the turns are bound per move.
"""

from functools import partial

import by_degrees

optimise = partial(by_degrees.optimise, objective="travel", max_turn=15.0)
find_front = partial(by_degrees.find_front, objective="travel", max_turn=15.0)
