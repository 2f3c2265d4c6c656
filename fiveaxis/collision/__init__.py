"""Bodies around the tool, and whether anything comes too near to anything else."""

from fiveaxis.collision.fixtures import Fixture, FixtureTable
from fiveaxis.collision.surroundings import Clearances, ClearanceTable, Surroundings

__all__ = ["ClearanceTable", "Clearances", "Fixture", "FixtureTable", "Surroundings"]
