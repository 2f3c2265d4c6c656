"""What `import fiveaxis as fx` offers, and what it costs."""

from __future__ import annotations

import subprocess
import sys

import pytest

import fiveaxis as fx
from fiveaxis.batch import run_batch

# Loads nothing but the package itself; a name's own room comes when it is asked for.
LOADED = """
import sys
import fiveaxis
heavy = ("numpy", "distributed")
print(sorted(name for name in sys.modules if name.startswith("fiveaxis.") or name in heavy))
"""


@pytest.mark.parametrize("name", fx.__all__)
def test_every_name_is_there_and_says_what_it_is(name):
    assert name in dir(fx)
    assert getattr(fx, name).__doc__


def test_batches_are_on_the_public_face():
    assert fx.run_batch is run_batch


def test_importing_the_package_loads_no_room():
    run = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert run.stdout == "[]\n"


def test_a_name_that_isnt_there_is_named():
    with pytest.raises(AttributeError, match="no attribute 'run_bach'"):
        _ = fx.run_bach
