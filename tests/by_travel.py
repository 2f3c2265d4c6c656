"""`optimise` for what is measured by the travel metric of form-shaping Eq. 1, the paper's objective."""

from functools import partial

from fiveaxis.posture import optimise as optimise_postures

optimise = partial(optimise_postures, objective="travel")
