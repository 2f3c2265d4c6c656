"""What motion costs: drives, totals, the power surface."""

from fiveaxis.energy.drives import drive_power, travel_costs
from fiveaxis.energy.surface import PowerSurface, power_surface
from fiveaxis.energy.totals import Energy, motion_energy, move_energies

__all__ = [
    "Energy",
    "PowerSurface",
    "drive_power",
    "motion_energy",
    "move_energies",
    "power_surface",
    "travel_costs",
]
