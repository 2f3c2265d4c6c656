"""Bodies around the tool, and checks whether any two of them come too near."""

from fiveaxis.collision.surroundings import Clearances, ClearanceTable, Fixture, FixtureTable, Surroundings

__all__ = ["ClearanceTable", "Clearances", "Fixture", "FixtureTable", "Surroundings"]
