"""Compilation of inner loops."""

from __future__ import annotations

import hashlib
import logging
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numba.core.caching import CacheImpl, InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator
from numba.extending import register_jitable
from numba.np import linalg

P = ParamSpec("P")
T = TypeVar("T")
_PACKAGE = __name__.partition(".")[0] + "."
logger = logging.getLogger(__name__)

# Instructions that every processor of an architecture has: digits are the same on all of them, and machine
# code made on one runs on another (`.ci/compile_ahead.py`). Loops aren't slower for it. What else numba
# compiles in this process is made of them, too; where it has compiled before, that decides for our loops.
if numba.config.CPU_NAME is None and numba.config.CPU_FEATURES is None:
    numba.config.CPU_NAME, numba.config.CPU_FEATURES = "generic", ""
_look_for_blas = linalg.ensure_blas


def _look_when_needed() -> None:
    """Look for BLAS, but not while numba loads: that loads scipy's linear algebra, in a tenth of a second.

    Our loops need none, and what needs it looks for it again when it is compiled.
    """
    if hasattr(sys.modules.get("numba.np.arraymath"), "_HAVE_BLAS"):
        _look_for_blas()


linalg.ensure_blas = _look_when_needed


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


class _MadeOfParts:
    """Takes kept machine code only if all that it is made of is unchanged, also in other files.

    numba looks at the file of the function alone, while the code holds its parts (`inner`) and constants.
    """

    def __init__(self, function: FunctionType, file: str) -> None:
        super().__init__(function, file)  # type: ignore[call-arg]
        self._function = function

    @classmethod
    def from_function(cls, function: FunctionType, file: str) -> Any:
        """Return the place of a function's machine code; None for another package's."""
        own = (function.__module__ or "").startswith(_PACKAGE)
        return super().from_function(function, file) if own else None  # type: ignore[misc]

    def get_source_stamp(self) -> bytes:
        """Compute a digest of the files of a function and its parts, and of the constants that they name."""
        found, made_of = [self._function], hashlib.sha256()
        for function in found:
            for value in _named(function):
                if isinstance(value, FunctionType):
                    if value.__module__.startswith(_PACKAGE) and value not in found:
                        found.append(value)
                elif isinstance(value, np.ndarray):
                    made_of.update(value.tobytes())
                elif isinstance(value, (int, float, tuple)):
                    made_of.update(repr(value).encode())
        for file in dict.fromkeys(part.__code__.co_filename for part in found):
            made_of.update(_source(file))
        return made_of.digest()


class Provided(_MadeOfParts, UserProvidedCacheLocator):  # type: ignore[misc]
    """Keeps machine code in the folder that NUMBA_CACHE_DIR names."""


class Beside(_MadeOfParts, InTreeCacheLocator):  # type: ignore[misc]
    """Keeps machine code beside the modules."""


class OfUser(_MadeOfParts, UserWideCacheLocator):  # type: ignore[misc]
    """Keeps machine code in the user's cache, where the package can't be written."""


# Functions of other packages are kept where numba keeps them.
if not numba.config.CACHE_LOCATOR_CLASSES:
    own = [f"{__name__}.{place.__name__}" for place in (Provided, Beside, OfUser)]
    numba.config.CACHE_LOCATOR_CLASSES = ",".join([*own, *(c.__name__ for c in CacheImpl._locator_classes)])


@cache
def _source(file: str) -> bytes:
    return Path(file).read_bytes()


def _named(function: FunctionType) -> Iterator[Any]:
    """Yield what a function names of its module and was made about; of compiled functions the Python ones."""
    about = [cell.cell_contents for cell in function.__closure__ or ()]
    for value in (*(function.__globals__.get(name) for name in function.__code__.co_names), *about):
        yield getattr(value, "py_func", value)


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
