"""Power of a cut from the wrench that a dynamometer measures: functions of the milling paper.

Olteanu, Bîșu and Tănase measure the wrench (force R and moment M at a point) on the workpiece and multiply it
by the cutter's twist (velocity v of that point and angular velocity ω). This gives two powers:

- `wrench_power`, ``R·v + M·ω``: the mechanical power. It doesn't depend on the point, as long as moment
  *and* velocity belong to the same one: a shift by d changes the moment's share by ``-(d × R)·ω`` and the
  velocity's by the opposite.
- `absolute_sum_power`, the paper's Eq. (17), adds the magnitudes ``|F_x v_x| + |F_y v_y| + |M_z ω_z|``.
  Magnitudes don't cancel, so it depends on the point.

References
----------
Olteanu, Bîșu, Tănase, "Determination of power consumption in milling", UPB Sci. Bull.; equation
numbers below are this paper's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array
from fiveaxis.base.errors import SettingError
from fiveaxis.lab.cutting.engagement import WATT, require

ROUNDING = 1e-9  # share of a turn that a record may lack at its end, from rounded time stamps


def net_power(depth: ArrayLike, width: ArrayLike, feed: ArrayLike, specific_force: ArrayLike) -> Array:
    """Compute the handbook's net cutting power: removal rate times specific force (Olteanu, Eq. 1).

    ``P_n = a_p a_e v_f k_c``; the 60·10⁶ of Eq. (1) only turns mm/min and N·mm into kW.

    Parameters
    ----------
    depth, width : (...), mm, axial depth a_p and radial width a_e
    feed : (...), mm/s, v_f
    specific_force : (...), N/mm², k_c of the material at the chip thickness

    Returns
    -------
    (...), W

    Raises
    ------
    SettingError
        A figure is below 0, or the specific force isn't positive.
    """
    section = require("depth of cut", depth, "mm", least=0.0) * require("width", width, "mm", least=0.0)
    pressure = require("specific cutting force", specific_force, "N/mm²", above=0.0)
    return section * require("feed", feed, "mm/s", least=0.0) * pressure / WATT


def wrench_power(force: Array, moment: Array, velocity: Array, angular_velocity: Array) -> Array:
    """Multiply wrench and twist: the mechanical power ``R·v + M·ω`` (Olteanu, Eqs. 2-5).

    It doesn't depend on the point, if moment and velocity belong to the same one (`transport_moment`,
    `transport_velocity`). It is positive where the wrench drives the moving body: with the force *on the
    tool* the cut takes ``-wrench_power`` from the machine.

    Parameters
    ----------
    force, moment : (..., 3), N and N·mm, one frame, moment about the point
    velocity : (..., 3), mm/s, of the point
    angular_velocity : (..., 3), rad/s

    Returns
    -------
    (...), W
    """
    return (np.sum(force * velocity, axis=-1) + np.sum(moment * angular_velocity, axis=-1)) / WATT


def absolute_sum_power(force: Array, moment: Array, velocity: Array, angular_velocity: Array) -> Array:
    """Add the magnitudes of the wrench-twist products, axis by axis (Olteanu, Eq. 17).

    ``P_c(θ) = |F_x (v_c sinθ + v_f)| + |F_y v_c cosθ| + |M_z ω_z|`` with the tooth's velocity from
    `tooth_velocities` and a spindle along z; never below ``|wrench_power|``. It *depends on the point*,
    because another point shifts power between terms whose signs are then dropped: quote it with its point,
    and use `wrench_power` for energy.

    Parameters
    ----------
    force, moment : (..., 3), N and N·mm, one frame, moment about the point
    velocity : (..., 3), mm/s, of the point
    angular_velocity : (..., 3), rad/s

    Returns
    -------
    (...), W
    """
    translation = np.sum(np.abs(force * velocity), axis=-1)
    return (translation + np.sum(np.abs(moment * angular_velocity), axis=-1)) / WATT


def transport_moment(force: Array, moment: Array, old: Array, new: Array) -> Array:
    """Move a moment to another point: ``M_new = M_old + (old - new) × R`` (Olteanu, Eqs. 11-13).

    The arm runs from the new point to the old one, as in the paper's Eq. (12), ``M_S = M_O + SO × R``. Eq.
    (13) is printed with DO although it starts from S; its arm must be DS.

    Parameters
    ----------
    force, moment : (..., 3), N and N·mm, one frame
    old, new : (..., 3), mm, same frame

    Returns
    -------
    (..., 3), N·mm
    """
    return moment + np.cross(old - new, force)


def transport_velocity(velocity: Array, angular_velocity: Array, old: Array, new: Array) -> Array:
    """Move a rigid body's velocity to another point: ``v_new = v_old + ω × (new - old)`` (Olteanu, Eqs. 2-5).

    Parameters
    ----------
    velocity, angular_velocity : (..., 3), mm/s and rad/s, one frame
    old, new : (..., 3), mm, same frame

    Returns
    -------
    (..., 3), mm/s
    """
    return velocity + np.cross(angular_velocity, new - old)


def cutter_positions(start: ArrayLike, feed: float, time: ArrayLike) -> Array:
    """Compute the positions of the cutter's centre: ``X_S = X_0 + v_f t`` along +x (Olteanu, Eqs. 6-10).

    Parameters
    ----------
    start : (3,), mm, centre at time 0
    feed : mm/s, v_f
    time : (n,), s

    Returns
    -------
    (n, 3), mm, S
    """
    along = feed * np.asarray(time, dtype=float)
    return np.asarray(start, dtype=float) + along[..., None] * np.array([1.0, 0.0, 0.0])


def rotation_angles(spin: float, time: ArrayLike, *, start: float = 0.0) -> Array:
    """Compute the tooth's angle: ``θ = θ_0 + ω_z t``, ``Δθ = 6 n Δt`` in deg, rev/min (Olteanu, Eqs. 6-10).

    Parameters
    ----------
    spin : rad/s about +z; negative for a spindle that turns clockwise seen from above (M3)
    time : (n,), s
    start : rad, angle at time 0, from +x towards +y

    Returns
    -------
    (n,), rad
    """
    return start + spin * np.asarray(time, dtype=float)


def tooth_positions(centre: Array, angle: Array, radius: float) -> Array:
    """Compute the position of the tooth tip: ``D = S + R (cosθ, sinθ, 0)`` (Olteanu, Eqs. 6-10).

    Parameters
    ----------
    centre : (n, 3), mm, S
    angle : (n,), rad, from +x towards +y
    radius : mm

    Returns
    -------
    (n, 3), mm, D
    """
    return centre + radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)


def tooth_velocities(angle: Array, spin: float, radius: float, feed: float) -> Array:
    """Compute the velocity of `tooth_positions` while the centre feeds along +x (Olteanu, Eqs. 6-10).

    ``(v_f - R ω_z sinθ, R ω_z cosθ, 0)``. With ``ω_z = -v_c/R``, a clockwise spindle, this is the
    ``v_c sinθ + v_f`` and ``v_c cosθ`` of Eq. (17).

    Parameters
    ----------
    angle : (n,), rad, from +x towards +y
    spin : rad/s about +z; negative for a spindle that turns clockwise seen from above (M3)
    radius : mm; 0 gives the centre's own velocity
    feed : mm/s, v_f

    Returns
    -------
    (n, 3), mm/s
    """
    turning = spin * radius * np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)], axis=-1)
    return turning + np.array([feed, 0.0, 0.0])


def revolution_average(power: ArrayLike, time: ArrayLike, spin: float) -> float:
    """Average a record over its first turn ``t_rot = 2π/|ω_z|`` by the trapezoidal rule (Olteanu, Eq. 18).

    The samples of a real record don't coincide with the turn's end: the last interval is cut there.

    Parameters
    ----------
    power : (n,), W
    time : (n,), s, rising
    spin : rad/s about +z

    Returns
    -------
    W

    Raises
    ------
    SettingError
        The times don't rise, the record is shorter than one turn, or the spindle stands still.
    """
    values, times = require("power", power, "W"), require("time", time, "s")
    turn = 2.0 * np.pi / float(require("spindle speed (magnitude)", abs(spin), "rad/s", above=0.0))
    if values.shape != times.shape or times.ndim != 1 or (np.diff(times) <= 0.0).any():
        raise SettingError(
            f"power {values.shape} and time {times.shape} must be lists of one length, time rising"
        )
    length = float(times[-1] - times[0]) if times.size else 0.0
    if length < turn * (1.0 - ROUNDING):
        raise SettingError(
            f"the record lasts {length:g} s, less than one turn of {turn:g} s; record a whole turn"
        )
    end = min(times[0] + turn, times[-1])
    inside = times < end
    samples = np.append(times[inside], end)
    return float(np.trapezoid(np.interp(samples, times, values), samples)) / turn
