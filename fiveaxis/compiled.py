"""How the inner loops are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
T = TypeVar("T")


def compiled(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a function at its first call, keep the machine code for the next run, and let threads run.

    Divisions by 0 give infinity, as numpy's do: checks for them cost half of a loop's time.
    """
    options = {"cache": True, "nogil": True, "error_model": "numpy"}
    return cast("Callable[P, T]", numba.njit(**options)(function))
