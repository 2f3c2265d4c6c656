"""What motion costs: drives, totals, the power surface."""

from fiveaxis.energy.block_costs import BlockCosts, block_costs
from fiveaxis.energy.budget import Budget, Factors, Process, Share, cutting_energy, job_budget
from fiveaxis.energy.calibration import calibrate_drive
from fiveaxis.energy.calibration_record import Calibration, RunEnergy
from fiveaxis.energy.cutting_forces import (
    CuttingCoefficients,
    CuttingRecord,
    cutting_record,
    mean_cutting_power,
)
from fiveaxis.energy.drilling import (
    Drill,
    DrillCoefficients,
    DrillingLoad,
    auxiliary_power,
    drilling_load,
    drilling_power,
    drilling_removal_rate,
    idle_power,
)
from fiveaxis.energy.drilling_fits import (
    fit_auxiliary_power,
    fit_cutting_model,
    fit_idle_power,
    fit_removal_model,
    fit_removal_speed_model,
)
from fiveaxis.energy.drives import (
    axis_powers,
    drive_power,
    gravity_forces,
    lifting_costs,
    moved_weights,
    travel_costs,
)
from fiveaxis.energy.engagement import Cut, EndMill, removal_rate, swept_surface
from fiveaxis.energy.least_costs import LeastCosts, least_travel_costs
from fiveaxis.energy.milling import (
    absolute_sum_power,
    cutter_positions,
    net_power,
    revolution_average,
    rotation_angles,
    tooth_positions,
    tooth_velocities,
    transport_moment,
    transport_velocity,
    wrench_power,
)
from fiveaxis.energy.origin import power_findings
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
    "CuttingCoefficients",
    "CuttingRecord",
    "Drill",
    "DrillCoefficients",
    "DrillingLoad",
    "EndMill",
    "Energy",
    "Factors",
    "KindEnergy",
    "LeastCosts",
    "PowerSurface",
    "Process",
    "RunEnergy",
    "Share",
    "Timing",
    "absolute_sum_power",
    "auxiliary_power",
    "axis_powers",
    "block_costs",
    "calibrate_drive",
    "cutter_positions",
    "cutting_energy",
    "cutting_record",
    "drilling_load",
    "drilling_power",
    "drilling_removal_rate",
    "drive_power",
    "energy_draws",
    "fit_auxiliary_power",
    "fit_cutting_model",
    "fit_idle_power",
    "fit_removal_model",
    "fit_removal_speed_model",
    "gravity_forces",
    "idle_power",
    "job_budget",
    "law_energies",
    "least_travel_costs",
    "lifting_costs",
    "mean_cutting_power",
    "motion_energy",
    "move_energies",
    "move_powers",
    "moved_weights",
    "net_power",
    "path_feed",
    "posture_costs",
    "power_findings",
    "power_surface",
    "removal_rate",
    "revolution_average",
    "rotation_angles",
    "swept_surface",
    "tooth_positions",
    "tooth_velocities",
    "transport_moment",
    "transport_velocity",
    "travel_costs",
    "wrench_power",
]
