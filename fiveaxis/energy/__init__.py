"""What motion costs: drives, totals, the power surface."""

from fiveaxis.energy.block_costs import BlockCosts, block_costs, least_travel_costs
from fiveaxis.energy.budget import Budget, Factors, Process, Share, cutting_energies, job_budget
from fiveaxis.energy.calibration import calibrate_drive
from fiveaxis.energy.calibration_record import Calibration, RunEnergy
from fiveaxis.energy.cutting_forces import (
    CuttingCoefficients,
    mean_cutting_power,
)
from fiveaxis.energy.drilling import (
    Drill,
    auxiliary_power,
    idle_power,
    mean_drilling_power,
)
from fiveaxis.energy.drives import (
    axis_powers,
    drive_power,
    gravity_forces,
    lifting_costs,
    moved_weights,
    power_findings,
    travel_costs,
)
from fiveaxis.energy.engaged import CutCourse, Engaged
from fiveaxis.energy.engagement import Cut, EndMill, removal_rate, swept_surface
from fiveaxis.energy.path_feed import path_feed
from fiveaxis.energy.surface import PowerSurface, posture_costs, power_surface
from fiveaxis.energy.totals import (
    DRAWN,
    Energy,
    KindEnergy,
    Timing,
    energy_draws,
    law_energies,
    motion_energy,
    move_energies,
    move_powers,
)

__all__ = [
    "DRAWN",
    "BlockCosts",
    "Budget",
    "Calibration",
    "Cut",
    "CutCourse",
    "CuttingCoefficients",
    "Drill",
    "EndMill",
    "Energy",
    "Engaged",
    "Factors",
    "KindEnergy",
    "PowerSurface",
    "Process",
    "RunEnergy",
    "Share",
    "Timing",
    "auxiliary_power",
    "axis_powers",
    "block_costs",
    "calibrate_drive",
    "cutting_energies",
    "drive_power",
    "energy_draws",
    "gravity_forces",
    "idle_power",
    "job_budget",
    "law_energies",
    "least_travel_costs",
    "lifting_costs",
    "mean_cutting_power",
    "mean_drilling_power",
    "motion_energy",
    "move_energies",
    "move_powers",
    "moved_weights",
    "path_feed",
    "posture_costs",
    "power_findings",
    "power_surface",
    "removal_rate",
    "swept_surface",
    "travel_costs",
]
