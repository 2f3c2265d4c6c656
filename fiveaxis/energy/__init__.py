"""What motion costs: drives, totals, the power surface."""

from fiveaxis.energy.drives import axis_powers, drive_power, travel_costs
from fiveaxis.energy.gravity import gravity_forces, moved_weights
from fiveaxis.energy.surface import PowerSurface, power_surface
from fiveaxis.energy.totals import Energy, motion_energy, move_energies, move_powers

__all__ = [
    "Energy",
    "PowerSurface",
    "axis_powers",
    "drive_power",
    "gravity_forces",
    "motion_energy",
    "move_energies",
    "move_powers",
    "moved_weights",
    "power_surface",
    "travel_costs",
]
