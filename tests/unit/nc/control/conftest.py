"""What the tests of reading programs share."""

from __future__ import annotations

import haas
import pytest

from fiveaxis.machine import Machine


@pytest.fixture(scope="session")
def haas_trunnion() -> Machine:
    """Return the Haas trunnion."""
    return haas.haas_trunnion()
