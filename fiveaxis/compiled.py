"""Compilation of inner loops."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

P = ParamSpec("P")
T = TypeVar("T")


def compiled(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a function at its first call, cache the machine code, and release the GIL while it runs.

    Division by 0 gives infinity, as in numpy: checking for it takes half of a loop's time.
    """
    options = {"cache": True, "nogil": True, "error_model": "numpy"}
    return cast("Callable[P, T]", numba.njit(**options)(function))


def elementwise(function: Callable[..., float]) -> Callable[..., NDArray[np.float64]]:
    """Compile a function of numbers into one of arrays that broadcasts them, and cache the machine code."""
    numbers = ", ".join(["float64"] * function.__code__.co_argcount)
    compiled_function = numba.vectorize([f"float64({numbers})"], cache=True)(function)
    return cast("Callable[..., NDArray[np.float64]]", compiled_function)
