"""Former names: each works for one more version, with a warning that gives the new one."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def warn_former(old: str, new: str, stacklevel: int = 2) -> None:
    """Warn that a name or an option's value has been renamed.

    Parameters
    ----------
    old, new : as they are written
    stacklevel : of the caller to be warned, counted from the function that calls this one
    """
    warnings.warn(
        f"{old} is now {new}; the old name goes with the next version", DeprecationWarning, stacklevel + 1
    )


def former_names(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Make a module's ``__getattr__`` that finds former names under their new ones.

    Parameters
    ----------
    module : with the former names
    names : former name to new name with its module, ``"fiveaxis.mesh.load_mesh"``
    """

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warn_former(f"{module}.{name}", names[name], stacklevel=2)
        home, _, present = names[name].rpartition(".")
        return getattr(import_module(home), present)

    return find
