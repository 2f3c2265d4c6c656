"""Powers of a machine whose drives nobody has measured: borrowed from another machine, or estimated.

A linear drive takes ``P = a W |v| + b W`` while it moves (Edem & Balogun 2018, Eq. 1), with the weight W of
what it moves, and lifts its weight against gravity; a rotary one has friction in proportion to its weight,
too. The coefficients lie in the middle of those of the machines whose powers are published, and the bands
reach as far as these machines do: they differ from each other by more than any mass or motor explains.
`python tests/benchmarks/estimates.py` prints the estimates beside the measured powers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from fiveaxis.model.machine.axes import Axis
from fiveaxis.model.machine.drives import FrictionDrive
from fiveaxis.model.machine.files import load_machine
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.provenance import Provenance

# In place of a machine's name: estimates for all axes, whatever the machine's file states.
ESTIMATED = "estimated"
# Axes of another machine after its name: ``hayashi-640123:B=A,C=C``.
_LETTERS = re.compile(r"(?P<name>.+):(?P<pairs>[A-Z]=[A-Z](,[A-Z]=[A-Z])*)")
GRAVITY = 9.80665  # m/s²
# kg/mm²: a linear axis's own mass, over the square of the machine's mean travel. The linear axes of micro5
# have 7.2 kg at 60 mm (2.0e-3), those of takisawa-mac-v3 315 and 435 kg at 500 mm, which is assumed (1.5e-3).
MASS_PER_AREA = 1.7e-3
# mm: mean travel where no limits are known.
TRAVELS = {"desktop": 150.0, "machining-centre": 500.0, "portal": 1500.0}
# Own mass of a linear axis as a share of the machine's: 425 kg at 500 mm of travel, in a machine of 5.3 t.
CARRIAGE_SHARE = 0.08
# Own mass of a swivel or head that carries another rotary axis, and of a table or spindle head, as shares of
# a linear axis's; micro5 has 0.57 and, for a table without a chuck, 0.13.
CARRYING, CARRIED = 0.57, 0.35
# Friction over weight, and mechanical over electrical power: 0.2 W per N and m/s together. The drives of
# takisawa-mac-v3 need 0.78 and 1.14, a rolling guideway alone 0.01.
FRICTION, EFFICIENCY = 0.16, 0.8
# W/N, constant part while a linear axis moves: takisawa-mac-v3 0.05 and 0.10; hayashi-640123 0.003 and 0.008,
# and 0.12 for the vertical axis, whose brake is open and whose motor holds.
MOVING, MOVING_VERTICAL = 0.015, 0.05
# The same as a share of a motor's rated power: a drive that shows 36 % at standstill and 40 % in motion.
MOVING_SHARE = 0.04
# Short-time over rated torque of a servo motor.
OVERLOAD = 3.0
# Estimates lie within these factors of the true power, up and down.
LINEAR_BAND, MOTOR_BAND, ROTARY_BAND = 8.0, 4.0, 4.0
MASS_BAND = 2.5


def with_powers(machine: Machine, drives: str | None = None) -> Machine:
    """Return a machine in which every axis has a drive.

    Parameters
    ----------
    drives : machine whose drives are borrowed, by name or file, if need be with the axis to take for an own
        one (``hayashi-640123:B=A``); ``estimated`` for estimates of all axes; by default missing drives are
        estimated

    Raises
    ------
    MachineError, UnknownMachine
        The other machine lacks an axis or its power; there is no machine of that name.
    """
    if drives is None:
        return with_estimates(machine)
    if drives == ESTIMATED:
        kept = tuple(p for p in machine.provenance if not p.figure.endswith(" drive"))
        bare = tuple(replace(axis, drive=None) for axis in machine.axes)
        return with_estimates(replace(machine, axes=bare, provenance=kept))
    found = _LETTERS.fullmatch(drives)
    if found is None:
        return machine.with_drives_of(load_machine(drives))
    pairs = dict(pair.split("=") for pair in found["pairs"].split(","))
    return machine.with_drives_of(load_machine(found["name"]), pairs)


def lender_of(drives: str | None) -> str | None:
    """Return the name of the machine that `drives` borrows from; None if it borrows from none."""
    if drives is None or drives == ESTIMATED:
        return None
    found = _LETTERS.fullmatch(drives)
    return drives if found is None else found["name"]


def describe_powers(machine: Machine) -> str:
    """Say in a line which powers are estimated or borrowed; empty where all are the machine's own."""
    origins = {p.figure: p for p in machine.provenance}
    drives = {c: origins[f"{c} drive"] for c in machine.letters if f"{c} drive" in origins}
    parts = []
    if machine.bands:
        letters = ", ".join(machine.bands)
        sources = {drives[c].source.partition(", from ")[2] or "stated masses" for c in machine.bands}
        factors = sorted({high for _low, high in machine.bands.values()})
        spread = ", ".join(f"{_within(machine, factor)} by a factor of {factor:g}" for factor in factors)
        known = " and ".join(sorted(sources))
        parts.append(f"powers of {letters} are estimated from {known}, and may be wrong: {spread}")
    borrowed = [f"{c} from {p.borrowed}" for c, p in drives.items() if p.borrowed]
    if borrowed:
        parts.append(f"powers are borrowed: {', '.join(borrowed)}")
    return "; ".join(parts)


def _within(machine: Machine, factor: float) -> str:
    return " ".join(letter for letter, (_low, high) in machine.bands.items() if high == factor)


def with_estimates(machine: Machine) -> Machine:
    """Return a machine in which every axis has a drive: an estimated one where its own isn't known.

    Masses that aren't stated follow from the motor that accelerates them, the machine's mass, its travels, or
    the kind of machine, in this order. Every estimated figure has a band (`Provenance.band`).
    """
    missing = [axis for axis in machine.axes if axis.drive is None]
    if not missing:
        return machine
    estimate = _Estimate.of(machine)
    drives = {axis.letter: estimate.drive(axis) for axis in missing}
    axes = tuple(
        replace(axis, drive=drives[axis.letter], moved_mass=estimate.mass(axis))
        if axis.letter in drives
        else axis
        for axis in machine.axes
    )
    origins = [p for axis in missing for p in estimate.origins(axis, drives[axis.letter])]
    return replace(machine, axes=axes, provenance=(*machine.provenance, *origins))


@dataclass(frozen=True)
class _Estimate:
    """What the drives of a machine are estimated from.

    Parameters
    ----------
    travel : mm, mean of the linear axes
    own : kg, mass of a linear axis without those that it carries
    basis : in words, what this mass comes from
    """

    machine: Machine
    travel: float
    own: float
    basis: str

    @classmethod
    def of(cls, machine: Machine) -> _Estimate:
        """Take the size from the machine's mass, its travels or its kind."""
        spans = [a.limits.span for a in machine.axes if not a.is_rotary and math.isfinite(a.limits.span)]
        size = machine.size
        kind = size.kind or ("portal" if machine.code.kind == "head-head" else "machining-centre")
        if spans and size.kind is None:
            travel = math.prod(spans) ** (1.0 / len(spans))
            basis = f"travels of {travel:.0f} mm"
        else:
            travel, basis = TRAVELS[kind], f"the size of a {kind.replace('-', ' ')}"
        if size.mass is None:
            return cls(machine, travel, MASS_PER_AREA * travel**2, basis)
        return cls(machine, travel, CARRIAGE_SHARE * size.mass, f"the machine's {size.mass:g} kg")

    def mass(self, axis: Axis) -> float:
        """Return the mass that an axis moves, kg."""
        return self._mass(axis)[0]

    def drive(self, axis: Axis) -> FrictionDrive:
        """Estimate the drive of an axis, which carries those between it and the workpiece or the tool."""
        mass = self.mass(axis)
        weight = mass * GRAVITY
        if axis.is_rotary:
            arm = self.travel / 2.0
            inertia = mass * (arm / 1000.0) ** 2 / 2.0
            return FrictionDrive(FRICTION * weight * arm / 1000.0, inertia=inertia, efficiency=EFFICIENCY)
        moving = (MOVING_VERTICAL if axis.letter == self.machine.roles["vertical"] else MOVING) * weight
        if axis.motor_power is not None:
            moving = MOVING_SHARE * axis.motor_power
        # Forces are in J/mm: a thousandth of N.
        return FrictionDrive(FRICTION * weight / 1000.0, efficiency=EFFICIENCY, moving=moving)

    def origins(self, axis: Axis, drive: FrictionDrive) -> Iterator[Provenance]:
        """Yield the origin of the drive, and of the mass if it is estimated."""
        mass, basis = self._mass(axis)
        value = f"{mass:.3g} kg"
        if basis is not None:
            band = (1.0 / MASS_BAND, MASS_BAND)
            yield Provenance(f"{axis.letter} moved_mass", value, f"estimated from {basis}", False, band=band)
        factor = ROTARY_BAND if axis.is_rotary else LINEAR_BAND
        if not axis.is_rotary and axis.motor_power is not None:
            factor = MOTOR_BAND
        source = f"estimated from {value} moved" + ("" if basis is None else f", from {basis}")
        force = f"{drive.friction:.3g} N m" if axis.is_rotary else f"{1000.0 * drive.friction:.3g} N"
        shown = f"friction {force}, moving {drive.moving:.3g} W, efficiency {drive.efficiency:g}"
        yield Provenance(f"{axis.letter} drive", shown, source, False, band=(1.0 / factor, factor))

    def _mass(self, axis: Axis) -> tuple[float, str | None]:
        """Return the mass that an axis moves, kg, and what it comes from; None if it is stated."""
        if axis.moved_mass is not None:
            return axis.moved_mass, None
        speed, rate = axis.max_speed, axis.max_acceleration
        if axis.motor_power is not None and speed and rate and not axis.is_rotary:
            # What the motor accelerates at full speed for a short time.
            force = EFFICIENCY * OVERLOAD * axis.motor_power / (speed / 1000.0)
            return force / (rate / 1000.0 + FRICTION * GRAVITY), f"its motor of {axis.motor_power:g} W"
        code = self.machine.code
        side = code.table[::-1] if axis.letter in code.table else code.head
        carried = side[side.index(axis.letter) :]
        return sum(self._own(letter, carried) for letter in carried), self.basis

    def _own(self, letter: str, carried: tuple[str, ...]) -> float:
        """Return the mass of an axis without those that it carries, kg."""
        if letter not in "ABC":
            return self.own
        further = carried[carried.index(letter) + 1 :]
        return self.own * (CARRYING if any(c in "ABC" for c in further) else CARRIED)
