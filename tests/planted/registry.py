"""All classes of faults in programs, by name."""

from planted import approach, between, geometric, keys, operations, start, states, technology
from planted.fault import Fault

FAULTS: tuple[Fault, ...] = (
    *geometric.FAULTS,
    *technology.FAULTS,
    *approach.FAULTS,
    *start.FAULTS,
    *states.FAULTS,
    *between.FAULTS,
    *operations.FAULTS,
    *keys.FAULTS,
)
