"""Checks of figures against their bounds; each error names the figure, its value and its unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.errors import InputError, SettingError
from fiveaxis.geometry import Array


def require_finite(
    name: str, values: ArrayLike, unit: str, *, error: type[InputError] = SettingError
) -> Array:
    """Return figures as an array; raise if one isn't a finite number."""
    figures = np.asarray(values, dtype=float)
    _refuse(name, figures, ~np.isfinite(figures), unit, "it must be a finite number", error)
    return figures


def require_positive(
    name: str, values: ArrayLike, unit: str, *, error: type[InputError] = SettingError
) -> Array:
    """Return figures as an array; raise if one isn't above zero."""
    figures = require_finite(name, values, unit, error=error)
    _refuse(name, figures, figures <= 0.0, unit, f"give a number above 0 {unit}", error)
    return figures


def require_not_negative(
    name: str, values: ArrayLike, unit: str, *, error: type[InputError] = SettingError
) -> Array:
    """Return figures as an array; raise if one is below zero."""
    figures = require_finite(name, values, unit, error=error)
    _refuse(name, figures, figures < 0.0, unit, f"give 0 {unit} or more", error)
    return figures


def require_at_most(name: str, value: float, bound: float, unit: str, remedy: str) -> None:
    """Raise if a figure is above a bound that other figures set; `remedy` says what to change."""
    if value > bound:
        raise SettingError(f"{name} is {value:g} {unit}, above {bound:g} {unit}; {remedy}")


def _refuse(
    name: str, figures: Array, wrong: ArrayLike, unit: str, remedy: str, error: type[InputError]
) -> None:
    at = np.flatnonzero(wrong)
    if not len(at):
        return
    which = f" (value {at[0] + 1} of {figures.size})" if figures.ndim else ""
    raise error(f"{name} is {figures.flat[at[0]]:g} {unit}{which}; {remedy}")
