"""Many jobs: sweeps that make many of one file, workers that run them, and one table of the results."""

from fiveaxis.batch.machines import Candidate, MachineComparison, compare
from fiveaxis.batch.record import Event, Row, Status
from fiveaxis.batch.run import Batch, run_batch

__all__ = [
    "Batch",
    "Candidate",
    "Event",
    "MachineComparison",
    "Row",
    "Status",
    "compare",
    "run_batch",
]
