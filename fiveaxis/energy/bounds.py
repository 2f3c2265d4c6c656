"""Bounds on the figures of a cut: what must be positive, and how a figure out of its bounds is named."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.errors import InputError, SettingError
from fiveaxis.geometry import Array


def require_finite(
    name: str, values: ArrayLike, unit: str, *, error: type[InputError] = SettingError
) -> Array:
    """Refuse figures that aren't finite numbers; return them as an array."""
    figures = np.asarray(values, dtype=float)
    _refuse(name, figures, ~np.isfinite(figures), unit, "it must be a finite number", error)
    return figures


def require_positive(
    name: str, values: ArrayLike, unit: str, *, error: type[InputError] = SettingError
) -> Array:
    """Refuse figures that aren't above zero; return them as an array."""
    figures = require_finite(name, values, unit, error=error)
    _refuse(name, figures, figures <= 0.0, unit, f"give a number above 0 {unit}", error)
    return figures


def require_not_negative(
    name: str, values: ArrayLike, unit: str, *, error: type[InputError] = SettingError
) -> Array:
    """Refuse figures below zero; return them as an array."""
    figures = require_finite(name, values, unit, error=error)
    _refuse(name, figures, figures < 0.0, unit, f"give 0 {unit} or more", error)
    return figures


def require_at_most(
    name: str, value: float, bound: float, unit: str, remedy: str, *, error: type[InputError] = SettingError
) -> None:
    """Refuse a figure above a bound that the other figures set; the remedy says which to change."""
    if value > bound:
        raise error(f"{name} is {value:g} {unit}, above {bound:g} {unit}; {remedy}")


def _refuse(
    name: str, figures: Array, wrong: ArrayLike, unit: str, remedy: str, error: type[InputError]
) -> None:
    at = np.flatnonzero(wrong)
    if not len(at):
        return
    place = f" (value {at[0] + 1} of {figures.size})" if figures.ndim else ""
    raise error(f"{name} is {figures.flat[at[0]]:g} {unit}{place}; {remedy}")
