"""Many jobs: sweeps that make many of one file, workers that run them, and one table of the results."""

from fiveaxis.batch.machines import Candidate as Candidate
from fiveaxis.batch.machines import MachineComparison as MachineComparison
from fiveaxis.batch.machines import compare as compare
from fiveaxis.batch.record import Event as Event
from fiveaxis.batch.record import Row as Row
from fiveaxis.batch.record import Status as Status
from fiveaxis.batch.run import Batch as Batch
from fiveaxis.batch.run import run_batch as run_batch
