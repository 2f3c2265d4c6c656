"""Choice of the rotary angles of every cutter location."""

from fiveaxis.posture.bound.lower_bound import LowerBound as LowerBound
from fiveaxis.posture.bound.lower_bound import bound_energy as bound_energy
from fiveaxis.posture.bound.lower_bound import bound_travel as bound_travel
from fiveaxis.posture.optimiser import optimise_postures as optimise_postures
from fiveaxis.posture.optimiser import with_bound as with_bound
from fiveaxis.posture.options import Options as Options
from fiveaxis.posture.problem import Problem as Problem
from fiveaxis.posture.solution import RESULT as RESULT
from fiveaxis.posture.solution import Baseline as Baseline
from fiveaxis.posture.solution import Optimum as Optimum
from fiveaxis.posture.solution import SolverStep as SolverStep
from fiveaxis.posture.strategy.effort import Effort as Effort
from fiveaxis.posture.strategy.front import Front as Front
from fiveaxis.posture.strategy.front import FrontPoint as FrontPoint
from fiveaxis.posture.strategy.front import find_front as find_front
