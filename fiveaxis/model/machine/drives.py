"""Models of feed drives, with their figures.

Internally a force is in J/mm and a torque in J/rad, so force times axis speed is in W for every axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

# mm/s and rad/s, the slowest speeds of the only published table of axis powers, 250 mm/min and 250 deg/min
# (Hayashi et al. 2018): assumed where a drive states none.
SLOWEST, SLOWEST_TURN = 250.0 / 60.0, math.radians(250.0) / 60.0


@dataclass(frozen=True, kw_only=True)
class Measured:
    """The speeds at which a drive's power was measured.

    Below the slowest and above the fastest its constant part is in proportion to the speed: servo logs show
    that power goes to nothing with the speed.

    Parameters
    ----------
    measured_from, measured_to : mm/s or rad/s, the slowest and the fastest; None where unknown
    """

    measured_from: float | None = None
    measured_to: float | None = None


@dataclass(frozen=True)
class DirectionalDrive(Measured):
    """Measured power of a feed drive by direction (Hayashi et al. 2018, power table).

    Parameters
    ----------
    plus, minus : power while the value grows or falls; W, or W per (rad/s) or (mm/s) if proportional
    proportional : whether power is in proportion to the axis's speed; otherwise it is the same at every speed
    """

    plus: float
    minus: float
    proportional: bool = False


@dataclass(frozen=True)
class AffineDrive(Measured):
    """Power that grows with speed from an offset: ``P = slope·|v| + offset`` at a measured speed.

    Parameters
    ----------
    plus, minus : (slope, offset) while the value grows or falls; W per (mm/s) or (rad/s), and W

    References
    ----------
    Edem & Balogun (2018), Eq. (5), less the base power that it includes.
    """

    plus: tuple[float, float]
    minus: tuple[float, float]


@dataclass(frozen=True)
class WeightDrive(Measured):
    """Power in proportion to the moved weight: ``P = a·W·|v| + b·W`` at a measured speed.

    Parameters
    ----------
    a : W per N and (m/s), a coefficient of friction over the drive's efficiency
    b : W per N, constant part

    References
    ----------
    Edem & Balogun (2018), Eq. (1); W is the weight of the axis with workpiece and vice, in N.
    """

    a: float
    b: float


@dataclass(frozen=True)
class FrictionDrive(Measured):
    """Drive from first principles: inertia, friction, gravity, losses.

    ``F = m·q̈ + F_c·sgn(q̇) + B·q̇ + G − F_b``; mechanical power ``F·q̇`` is divided by the efficiency when the
    drive pushes and multiplied by the regeneration when it brakes; ``c·F²`` heats the motor, ``moving`` is
    the constant part in motion, and ``hold`` is drawn all the time. G, the load of gravity, follows from the
    machine's masses and posture; the moment of inertia of a part on a rotary table isn't added to the table's
    own.

    Parameters
    ----------
    friction : F_c, J/mm or J/rad
    viscous : B, J·s/mm² or J·s/rad²
    counterbalance : F_b, J/mm or J/rad, in the direction of growing values
    inertia : of a rotary axis, J·s²/rad²; a linear axis has its moved mass
    efficiency : mechanical over electrical power while driving, in (0, 1]
    regeneration : returned electrical over mechanical power while braking, in [0, 0.9]; 0 with a brake
        resistor
    copper : c, W per (J/mm)² or (J/rad)²
    moving : W, constant part of the power in motion
    hold : W, also at standstill
    """

    friction: float = 0.0
    viscous: float = 0.0
    counterbalance: float = 0.0
    inertia: float = 0.0
    efficiency: float = 1.0
    regeneration: float = 0.0
    copper: float = 0.0
    moving: float = 0.0
    hold: float = 0.0


Drive = DirectionalDrive | AffineDrive | WeightDrive | FrictionDrive


def opposite(drive: Drive) -> Drive:
    """Return the drive of an axis that counts in the opposite direction."""
    if isinstance(drive, DirectionalDrive):
        return replace(drive, plus=drive.minus, minus=drive.plus)
    if isinstance(drive, AffineDrive):
        return replace(drive, plus=drive.minus, minus=drive.plus)
    if isinstance(drive, FrictionDrive):
        return replace(drive, counterbalance=-drive.counterbalance)
    return drive
