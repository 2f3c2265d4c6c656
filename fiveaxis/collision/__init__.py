"""Bodies around the tool, and checks whether any two of them come too near."""

from fiveaxis.collision.surroundings import Clearances as Clearances
from fiveaxis.collision.surroundings import ClearanceTable as ClearanceTable
from fiveaxis.collision.surroundings import Fixture as Fixture
from fiveaxis.collision.surroundings import FixtureTable as FixtureTable
from fiveaxis.collision.surroundings import Surroundings as Surroundings
