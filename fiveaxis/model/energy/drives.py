"""Feed drives: power while an axis moves, energy per unit of travel, and the load of gravity by posture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, MachineError, Severity, inverse_transform, product
from fiveaxis.model.kinematics.poses import link_poses, tip_slopes
from fiveaxis.model.machine.axes import Axis
from fiveaxis.model.machine.code import BED
from fiveaxis.model.machine.drives import AffineDrive, DirectionalDrive, Drive, FrictionDrive, WeightDrive
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.powers import GRAVITY, describe_powers
from fiveaxis.model.motion.timing import rapid_speeds

# mm/s or rad/s: at this speed a drive moves and nothing in its power is in proportion to the speed.
CREEPING = 1e-200
# Share of a speed by which it may exceed another one and count as the same.
ROUNDING = 1e-9
# Of the vertical component of a direction, and of a power in W.
DIGITS = 12
# Drives whose power depends on speed alone, along a line in either direction.
TabledDrive = DirectionalDrive | AffineDrive | WeightDrive


def drive_power(
    drive: Drive,
    speed: Array,
    *,
    acceleration: Array | float = 0.0,
    gravity: Array | float = 0.0,
    weight: float = 0.0,
    inertia: float = 0.0,
    cutting: Array | float = 0.0,
) -> Array:
    """Compute the electrical power of a drive.

    The force of the cut takes its mechanical power ``F_f v_f`` on top of a table's power; a friction drive
    has it among its forces. The part of the power that doesn't depend on speed holds between the measured
    speeds; slower and faster axes pay for their travel as at the nearest of them (`constant_share`).

    Parameters
    ----------
    drive : its model; a table of powers depends on speed only
    speed : (n,), mm/s or rad/s, signed
    acceleration : (n,), mm/s² or rad/s²
    gravity : (n,), J/mm or J/rad, the load that the axis holds against gravity (`gravity_forces`)
    weight : N, moved weight of a linear axis
    inertia : J per (mm/s)², moved mass of a linear axis; a rotary drive has its own inertia
    cutting : (n,), J/mm or J/rad, load of the cut while the value grows (`cutting_loads`)

    Returns
    -------
    (n,), W; negative where a braking drive returns power

    References
    ----------
    Directional: Hayashi et al. (2018), power table. Affine and weight: Edem & Balogun (2018), Eqs. (5) and
    (1). Friction: the mechanics of `FrictionDrive`.
    """
    force = cutting if isinstance(drive, FrictionDrive) else 0.0
    power = _power(drive, speed, gravity + force, weight, acceleration, inertia)
    power = power + (cutting - force) * speed
    if isinstance(drive, DirectionalDrive) and drive.proportional:
        return power
    beyond = constant_share(np.abs(speed), drive.measured_from, drive.measured_to) - np.sign(np.abs(speed))
    constant = _constant_part(drive, np.sign(speed), gravity + force, weight)
    return power + beyond * np.where(beyond > 0.0, np.maximum(constant, 0.0), constant)


def constant_share(speed: Array, slowest: float | None, fastest: float | None) -> Array:
    """Compute how much of the constant part of its power a drive takes at a speed, (n,); 0 at standstill.

    It was measured between the slowest and the fastest of the given speeds. Below them it falls in proportion
    to the speed, as measured servo drives do, and above them it grows so: the travel costs what it costs at
    the nearest measured speed. Speeds are in mm/s or rad/s, not below 0; None where nothing is assumed.
    """
    share = np.sign(speed) if slowest is None else np.minimum(1.0, speed / slowest)
    if fastest is None:
        return share
    # A move at the fastest measured speed isn't beyond it, else rounding would tell equal postures apart.
    return np.where(speed > (1.0 + ROUNDING) * fastest, speed / fastest, share)


def moving_power(
    drive: Drive, direction: Array, *, gravity: Array | float = 0.0, weight: float = 0.0
) -> Array:
    """Compute the constant part of a drive's power in motion, (n,) W, beyond what it draws at standstill.

    It isn't below 0. The direction, (n,), is 1 while the axis value grows and −1 while it falls.
    """
    return np.maximum(_constant_part(drive, direction, gravity, weight), 0.0)


def _constant_part(drive: Drive, direction: Array, gravity: Array | float, weight: float) -> Array:
    """Compute by how much the model's power jumps as an axis starts, (n,) W; below 0 if friction helps."""
    if not isinstance(drive, FrictionDrive):
        up, down = (measured_line(drive, side, weight)[1] for side in (0, 1))
        return np.where(direction > 0.0, up, down) * np.abs(direction)
    creeping, still = (_power(drive, v * direction, gravity, weight) for v in (CREEPING, 0.0))
    return creeping - still


def _power(
    drive: Drive,
    speed: Array,
    gravity: Array | float,
    weight: float,
    acceleration: Array | float = 0.0,
    inertia: float = 0.0,
) -> Array:
    """Compute the power of the model itself, as `drive_power` at a measured speed."""
    if not isinstance(drive, FrictionDrive):
        (up, up_offset), (down, down_offset) = (measured_line(drive, side, weight) for side in (0, 1))
        growing = speed > 0.0
        slope, offset = np.where(growing, up, down), np.where(growing, up_offset, down_offset)
        return np.where(speed == 0.0, 0.0, slope * np.abs(speed) + offset)
    force = (
        (inertia + drive.inertia) * acceleration
        + drive.friction * np.sign(speed)
        + drive.viscous * speed
        + gravity
        - drive.counterbalance
    )
    mechanical = force * speed
    electrical = np.where(mechanical > 0.0, mechanical / drive.efficiency, mechanical * drive.regeneration)
    moving = np.where(speed == 0.0, 0.0, drive.moving)
    return electrical + drive.copper * force**2 + moving + drive.hold


def measured_line(drive: TabledDrive, side: int, weight: float) -> tuple[float, float]:
    """Return slope, J/mm or J/rad, and offset, W, of a measured power while the value grows (0) or falls (1).

    `MachineError` for a weight drive without the weight, N.
    """
    if isinstance(drive, DirectionalDrive):
        level = (drive.plus, drive.minus)[side]
        return (level, 0.0) if drive.proportional else (0.0, level)
    if isinstance(drive, AffineDrive):
        return (drive.plus, drive.minus)[side]
    if not weight > 0.0:
        raise MachineError(f"a weight drive needs the moved weight; {weight:g} N was given")
    return weight * drive.a / 1000.0, weight * drive.b


def axis_powers(
    machine: Machine,
    positions: Array,
    speeds: Array,
    accelerations: Array | None = None,
    feed_force: Array | None = None,
) -> Array:
    """Compute the electrical power of every feed drive, (n, k) W; `MachineError` where one isn't known.

    Parameters
    ----------
    positions : (n, k), mm and rad; gravity's torques depend on them
    speeds, accelerations : (n, k), mm/s and rad/s, and per s²; no accelerations by default
    feed_force : (n,), N, of the cut against the tool's motion; none by default
    """
    drives, forces, weights = _loads(machine, positions)
    powers, cutting = np.empty_like(speeds), np.zeros_like(speeds)
    if feed_force is not None:
        cutting = cutting_loads(machine, positions, speeds, feed_force)
    for i, (drive, axis) in enumerate(zip(drives, machine.axes, strict=True)):
        powers[:, i] = drive_power(
            drive,
            speeds[:, i],
            acceleration=0.0 if accelerations is None else accelerations[:, i],
            gravity=forces[:, i],
            weight=float(weights[i]),
            # The moved weight in J per (mm/s)².
            inertia=0.0 if axis.is_rotary else float(weights[i]) / GRAVITY * 1e-6,
            cutting=cutting[:, i],
        )
    return powers


def cutting_loads(machine: Machine, positions: Array, speeds: Array, force: Array) -> Array:
    """Share a force against the tool's motion, (n,) N, out among the axes, (n, k) J/mm and J/rad.

    Their loads take ``F_f v_f`` together: by virtual work an axis has the load ``F_f (∂r/∂q)·v/|v|``, with
    the velocity v of the tip r in the workpiece frame. In Edem & Balogun (2018), Eqs. (1) and (5), moves have
    one axis.
    """
    slopes = tip_slopes(machine, positions)
    velocity = np.einsum("nik,nk->ni", slopes, speeds)
    length = np.linalg.norm(velocity, axis=1)
    share = np.divide(force / 1000.0, length, out=np.zeros_like(length), where=length > 0.0)
    return share[:, None] * np.einsum("ni,nik->nk", velocity, slopes)


def travel_costs(machine: Machine, feed: Array, rapid: BoolArray | None = None) -> tuple[Array, Array]:
    """Compute the energy per unit of axis travel at a programmed feed (Hayashi et al. 2018, Eq. 1).

    ``W = 60·P/v`` with P in W and v in mm/min or deg/min (form-shaping Eq. 1): the cost of a steady move of
    that axis alone. For a rotary axis the programmed number is in deg/min, as in the equation, even if its
    power doesn't depend on its speed. A rapid move has no feed: every axis is charged at its `rapid_speeds`.
    Outside the measured speeds W stays what it is at the nearest of them (`drive_power`). For friction drives
    the metric omits acceleration and the power at standstill, and takes gravity's torque with every axis at
    0; every total (`Energy`) states how far it is from the power integral.

    Parameters
    ----------
    feed, rapid : (n,), mm/s, and which moves are rapid; none by default

    Returns
    -------
    plus, minus : (n, k), J/mm and J/rad, while the axis value grows or falls

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    """
    drives, (forces,), weights = _loads(machine, np.zeros((1, len(machine.axes))))
    costs = np.empty((2, len(feed), len(drives)))
    rapid = np.zeros(len(feed), dtype=bool) if rapid is None else rapid
    fastest = rapid_speeds(machine, feed)
    for i, (drive, axis) in enumerate(zip(drives, machine.axes, strict=True)):
        # For a rotary axis the programmed number is in deg/min: feed in mm/s counts as deg/s.
        speed = np.radians(feed) if axis.is_rotary else np.asarray(feed, dtype=float)
        speed = np.where(rapid, fastest[:, i], speed)
        for side, sign in enumerate((1.0, -1.0)):
            costs[side, :, i] = _travel_cost(drive, speed, sign, float(forces[i]), float(weights[i]))
    return costs[0], costs[1]


def lifting_costs(machine: Machine, price: float) -> tuple[Array, Array]:
    """Charge every linear axis for lifting what it carries, whether that is the tool or the workpiece.

    An axis is charged a price, J per mm of rise, by the vertical component of its direction
    (`Machine.vertical`), while its value moves such that the carried mass rises: the value of a table's axis,
    tool relative to workpiece, falls then. Directions are those with every axis at 0. Lowering isn't
    refunded, nor is what a rotary axis lifts charged. Returned are (k,) J/mm while the axis value grows, and
    while it falls.
    """
    # What is level but for rounding lifts nothing.
    lifts = np.array([round(machine.lifts.get(axis.letter, 0.0), DIGITS) for axis in machine.axes])
    return price * np.maximum(lifts, 0.0), price * np.maximum(-lifts, 0.0)


def moving_powers(machine: Machine) -> Array:
    """Compute `moving_power` of each drive with the axes at 0, (2, k) W: its value grows or falls.

    `MachineError` where the power of an axis isn't known.
    """
    drives, (forces,), weights = _loads(machine, np.zeros((1, len(machine.axes))))
    sides, loads = np.array([1.0, -1.0]), zip(drives, forces, weights, strict=True)
    columns = [moving_power(d, sides, gravity=float(g), weight=float(w)) for d, g, w in loads]
    return np.stack(columns, axis=1)


def power_findings(machine: Machine) -> tuple[Finding, ...]:
    """Report estimated and borrowed drives, and slowest measured speeds that are assumed.

    `MachineError` where the power of an axis isn't known.
    """
    text, constant = describe_powers(machine), moving_powers(machine).round(DIGITS).any(axis=0)
    unstated = [getattr(axis.drive, "measured_from", None) is None for axis in machine.axes]
    assumed = [machine.axes[i] for i in np.flatnonzero(np.logical_and(constant, unstated))]
    guessed = _falling([axis for axis in assumed if axis.letter in machine.bands])
    own, found = _falling([axis for axis in assumed if axis.letter not in machine.bands]), []
    if machine.bands:
        remedy = "state masses or motors in the machine's file, or measure the powers (fiveaxis calibrate)"
        text = "; ".join(filter(None, (text, guessed, remedy)))
        found = [Finding(Severity.WARNING, "powers-estimated", text)]
    elif text:
        found = [Finding(Severity.NOTE, "powers-borrowed", text)]
    if own:
        text = f"{own}; state measured_from of these drives in the machine's file"
        found.append(Finding(Severity.NOTE, "slow-speed-assumed", text))
    return tuple(found)


def _falling(axes: Sequence[Axis]) -> str:
    """Say below which speeds powers are assumed to fall; empty without an axis."""
    speeds = {axis.letter: f"{60.0 * axis.shown(axis.slowest_assumed):.6g} {axis.unit}/min" for axis in axes}
    groups = {speed: " ".join(c for c, v in speeds.items() if v == speed) for speed in speeds.values()}
    where = ", ".join(f"{speed} ({letters})" for speed, letters in groups.items())
    return where and f"constant powers are assumed to fall in proportion to speed below {where}"


def require_drive(machine: Machine, axis: Axis) -> Drive:
    """Return an axis's drive, with the slowest measured speed that is assumed where it states none.

    `MachineError` if its power isn't known (the message names all such axes), or the mass that it needs.
    """
    if axis.drive is None:
        missing = ", ".join(a.letter for a in machine.axes if a.drive is None)
        raise MachineError(
            f"machine {machine.name!r} has no power for axis {missing}; add [axes.{axis.letter}.drive] "
            "to its file or take the powers of another machine (--drives NAME)"
        )
    if isinstance(axis.drive, WeightDrive | FrictionDrive) and not axis.is_rotary and axis.moved_mass is None:
        raise MachineError(
            f"the drive of {axis.letter} of machine {machine.name!r} needs the moved mass, which isn't "
            f"known; add [axes.{axis.letter}.moved_mass] to its file"
        )
    return replace(axis.drive, measured_from=axis.drive.measured_from or axis.slowest_assumed)


def _travel_cost(drive: Drive, speed: Array, sign: float, gravity: float, weight: float) -> Array:
    if isinstance(drive, DirectionalDrive) and drive.proportional:
        # A division by the speed would round differently from feed to feed.
        return np.full_like(speed, drive.plus if sign > 0.0 else drive.minus)
    power = drive_power(drive, sign * speed, gravity=gravity, weight=weight)
    if isinstance(drive, FrictionDrive):
        # Power drawn at standstill too isn't a cost of travel.
        power = power - drive_power(drive, np.zeros_like(speed), gravity=gravity, weight=weight)
    return np.divide(power, speed, out=np.zeros_like(speed), where=power != 0.0)


def _loads(machine: Machine, positions: Array) -> tuple[list[Drive], Array, Array]:
    """Collect the drives with gravity's forces, (n, k), if one depends on them, and moved weights, (k,) N."""
    drives = [require_drive(machine, axis) for axis in machine.axes]
    # Tables of power don't depend on gravity.
    loaded = any(isinstance(drive, FrictionDrive) for drive in drives)
    forces = gravity_forces(machine, positions) if loaded else np.zeros_like(positions)
    return drives, forces, moved_weights(machine)


def gravity_forces(machine: Machine, positions: Array) -> Array:
    """Compute the load that each axis holds against gravity: the derivative of the potential energy.

    A linear axis lifts its moved mass and, on the table, the load: ``m g d·up``. A rotary axis turns its mass
    about its line: ``m g (k × (c − p))·up``, which changes with its angle and with those of the axes between
    it and the bed; likewise the load of a table. Axis values are tool relative to workpiece, so a table moves
    in the opposite direction. An axis without `moved_mass` weighs nothing, a rotary one without `mass_centre`
    is balanced.

    Returns
    -------
    (n, k), J/mm and J/rad: positive where the axis works against gravity while its value grows
    """
    values = np.asarray(positions, dtype=float)
    poses = link_poses(machine, values)
    # Poses of the links in the bed's frame, in which gravity is constant.
    from_bed = inverse_transform(poses[BED])
    links = machine.code.links
    to_machine = machine.machine_frame  # the machine frame at home, in the workpiece frame
    up = product(to_machine[:3, :3], np.array(machine.vertical))
    load = product(to_machine, np.array([*machine.load.centre, 1.0]))
    forces = np.zeros_like(values)
    for index, joint in enumerate(machine.chain.joints):
        column = machine.column(joint.letter)
        axis = machine.axes[column]
        on_table = joint.letter in machine.code.table
        # The joint's line moves with the link before it, its mass with the link that it carries.
        line_pose = product(from_bed, poses[links[index]])
        link_pose = product(from_bed, poses[joint.letter])
        direction = product(line_pose[:, :3, :3], np.array(joint.line.direction))
        own = axis.moved_mass or 0.0
        if not joint.is_rotary:
            forces[:, column] = (own + (machine.load.mass if on_table else 0.0)) * product(direction, up)
        else:
            point = product(line_pose, np.array([*joint.line.point, 1.0]))
            if axis.mass_centre is not None:
                centre = product(to_machine, np.array([*axis.mass_centre, 1.0]))
                velocity = _velocity(direction, point, product(link_pose, centre))
                forces[:, column] += own * product(velocity, up)
            if on_table:
                velocity = _velocity(direction, point, product(from_bed, load))
                forces[:, column] += machine.load.mass * product(velocity, up)
        forces[:, column] *= (-1.0 if on_table else 1.0) * GRAVITY / 1000.0
    return forces


def _velocity(direction: Array, point: Array, centre: Array) -> Array:
    """Compute the velocity, (n, 3) mm/rad, of a centre that turns about a line; points are (n, 4)."""
    return np.cross(direction, (centre - point)[:, :3])


def moved_weights(machine: Machine) -> Array:
    """Compute the weight that each axis moves, (k,) N: its own mass and, on the table, the load.

    It is W of Edem & Balogun (2018), Eq. (1).
    """
    masses = [
        (a.moved_mass or 0.0) + (machine.load.mass if a.letter in machine.code.table else 0.0)
        for a in machine.axes
    ]
    return np.array(masses) * GRAVITY
