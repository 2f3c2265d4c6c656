"""What `import fiveaxis as fx` offers, and what it costs."""

import inspect
import re
import subprocess
import sys
from dataclasses import fields

import pytest

import fiveaxis as fx
from fiveaxis.base import Meshes, Search, Surrounding, options_of
from fiveaxis.job import run_batch
from fiveaxis.model import Constraints
from fiveaxis.posture import Options

# Loads nothing but the package itself; a name's own room comes when it is asked for.
LOADED = """
import sys
import fiveaxis
heavy = ("numpy", "distributed")
print(sorted(name for name in sys.modules if name.startswith("fiveaxis.") or name in heavy))
"""


def test_every_name_is_there_and_says_what_it_is():
    assert dir(fx) == sorted([*fx.__all__, "__version__"])
    assert [name for name in fx.__all__ if not getattr(fx, name).__doc__] == []


def test_batches_are_on_the_public_face():
    assert fx.run_batch is run_batch


def test_importing_the_package_loads_no_room():
    run = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert run.stdout == "[]\n"


def test_a_name_that_isnt_there_is_named():
    with pytest.raises(AttributeError, match="No fiveaxis attribute run_bach"):
        _ = fx.run_bach


def test_optimise_says_each_of_its_options_with_its_type():
    own = inspect.signature(fx.optimise).parameters
    options = {field.name: field for field in fields(Options)}
    bounds = {field.name for field in fields(Constraints)}
    # What keeps the tool clear is the job's; constraints are taken in degrees, and passed on as one record.
    clear = {"toolpath", "tool", "path_shape", "machine", "fixtures", "clearances", *options_of(Surrounding)}
    clear |= set(options_of(Meshes))
    # The program's control and coordinates decide what its blocks are and how long they take; a job with a
    # folder keeps what its long steps find, and a program that is revised in its lines holds its ends.
    program, decided = {"control", "coordinates"}, {"interpolation", "clock", "checkpoint", "holds_ends"}
    assert set(own) == clear | (set(options) - decided) | bounds | program
    assert bounds == set(inspect.signature(Constraints.of_degrees).parameters)
    for name, default in vars(Search()).items():
        assert own[name].default == options[name].default == default, name
    for parameter in own.values():
        assert parameter.kind is not inspect.Parameter.VAR_KEYWORD
        assert parameter.annotation is not inspect.Parameter.empty
        assert "Any" not in str(parameter.annotation)
        assert re.search(rf"\b{parameter.name}\b", fx.optimise.__doc__)


def test_no_function_hides_its_options():
    functions = [given for given in (getattr(fx, name) for name in fx.__all__) if inspect.isfunction(given)]
    parameters = {given: inspect.signature(given).parameters.values() for given in functions}
    hiding = [given for given, own in parameters.items() if any(p.kind is p.VAR_KEYWORD for p in own)]
    assert functions
    assert hiding == []
