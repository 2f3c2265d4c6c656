"""Compilation of inner loops."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import cache
from typing import ParamSpec, TypeVar

import numba
from numba.extending import register_jitable

P = ParamSpec("P")
T = TypeVar("T")
logger = logging.getLogger(__name__)

# Instructions that every processor of an architecture has: digits are the same on all of them, and machine
# code made on one runs on another (`.ci/compile_ahead.py`). Loops aren't slower for it. What else numba
# compiles in this process is made of them, too; where it has compiled before, that decides for our loops.
if numba.config.CPU_NAME is None and numba.config.CPU_FEATURES is None:
    numba.config.CPU_NAME, numba.config.CPU_FEATURES = "generic", ""


def compiled(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a function at its first call, cache the machine code, and release the GIL while it runs.

    Division by 0 gives infinity, as in numpy: checking for it takes half of a loop's time. References to
    arrays are counted whoever calls it first, also a part that counts none (`innermost`).
    """
    options = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": True}
    made: Callable[P, T] = _kept(lambda keep: numba.njit(cache=keep, **options)(function))
    return made


def inner(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a function as a part of the compiled ones that call it; from Python it runs as it stands.

    It needs no wrapper that takes records of arrays apart, for Python or C, which is up to half of what there
    is to compile, and no file of its own among the machine code.
    """
    made: Callable[P, T] = register_jitable(error_model="numpy", no_cfunc_wrapper=True)(function)
    return made


def innermost(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a function as `inner` does, one that makes no array: no references are counted in it.

    Counting those of each array that is taken out of a record takes longer than the arithmetic of a short
    function, where it isn't inlined.
    """
    options = {"error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}
    made: Callable[P, T] = register_jitable(**options)(function)
    return made


def _kept(make: Callable[[bool], T]) -> T:
    """Make a compiled function whose machine code is kept, or else one of this process alone."""
    try:
        return make(True)
    except RuntimeError:  # a read-only installation, and no home with a folder for caches
        _tell_that_nothing_is_kept()
        return make(False)


@cache
def _tell_that_nothing_is_kept() -> None:
    logger.warning(
        "machine code can't be kept, neither beside the package nor in the user's cache: every run compiles "
        "anew, for about a minute; name a folder that can be written in NUMBA_CACHE_DIR"
    )
