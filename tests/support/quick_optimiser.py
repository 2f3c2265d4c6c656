"""Optimiser functions with constraints in degrees and options as keywords, quick unless asked for more."""

from dataclasses import fields
from typing import Any

from fiveaxis import posture
from fiveaxis.model import Constraints, TiltBounds, Toolpath

QUICK = {"effort": "quick"}
BOUNDS = tuple(field.name for field in fields(Constraints))


def optimise(path: Toolpath, machine, **options: Any) -> posture.Optimum:
    """Choose postures; `options` are constraints in degrees and fields of `fiveaxis.posture.Options`."""
    return posture.optimise_postures(path, machine, _taken(options), posture.Options(**QUICK | options))


def find_front(path: Toolpath, machine, n: int = 8, feed_share=None, **options: Any) -> posture.Front:
    """Find a front; `options` as for `optimise`."""
    bounds = _taken(options)
    return posture.find_front(
        path,
        machine,
        bounds,
        n,
        posture.Options(**QUICK | options),
        feed_share=feed_share,
    )


def tilt_bounds(path: Toolpath, tilt=None, cone=None, **bounds: Any) -> TiltBounds:
    """Make the bounds on the tool's lean along a path."""
    return Constraints.of_degrees(tilt=tilt, cone=cone, **bounds).lean_bounds(path)


def for_tilt(path: Toolpath, tilt=None, cone=None, **bounds: Any) -> Toolpath:
    """Put a path into the zone of the cutter that bounds ask for."""
    return Constraints.of_degrees(tilt=tilt, cone=cone, **bounds).zoned(path)


def _taken(options: dict[str, Any]) -> Constraints:
    """Take the bounds out of options."""
    return Constraints.of_degrees(**{name: options.pop(name) for name in BOUNDS if name in options})
