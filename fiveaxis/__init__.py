"""fiveaxis: choose the tool posture of a 5-axis path that costs the machine the least energy.

    >>> import fiveaxis as fx
    >>> machine = fx.load_machine("hayashi-640123")
    >>> tool = fx.Tool.ball(10)
    >>> toolpath = fx.plan_contour("part.stl", tool, stepdown=1.0)
    >>> solution = fx.optimise(toolpath, machine, tilt=(15, 75), part="part.stl")
    >>> report = solution.write("part.ngc", control="linuxcnc")

Many jobs, each from a file, run in parallel; finished jobs aren't run again:

    >>> batch = fx.run_batch(["cup.toml", "vase.toml"], "out")

Modules are loaded when they are used, so importing the package is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from fiveaxis.batch import compare as compare
    from fiveaxis.batch import run_batch as run_batch
    from fiveaxis.contour import find_contacts as find_contacts
    from fiveaxis.contour import plan_contour as plan_contour
    from fiveaxis.energy import Energy as Energy
    from fiveaxis.energy import PowerSurface as PowerSurface
    from fiveaxis.energy import calibrate_drive as calibrate_drive
    from fiveaxis.energy import power_surface as power_surface
    from fiveaxis.errors import FiveAxisError as FiveAxisError
    from fiveaxis.findings import Finding as Finding
    from fiveaxis.job import Solution as Solution
    from fiveaxis.job import cutting_power as cutting_power
    from fiveaxis.job import post_program as post_program
    from fiveaxis.job import program_energy as program_energy
    from fiveaxis.job import revise_program as revise_program
    from fiveaxis.job import verify_program as verify_program
    from fiveaxis.job import write_program as write_program
    from fiveaxis.machine import Machine as Machine
    from fiveaxis.machine import load_machine as load_machine
    from fiveaxis.machine import machine_names as machine_names
    from fiveaxis.motion import Motion as Motion
    from fiveaxis.nc import ProgramSettings as ProgramSettings
    from fiveaxis.nc import read_operations as read_operations
    from fiveaxis.nc import read_program as read_program
    from fiveaxis.nc import read_toolpath as read_toolpath
    from fiveaxis.report import location_surface as location_surface
    from fiveaxis.report import path_valley as path_valley
    from fiveaxis.report import tip_surface as tip_surface
    from fiveaxis.toolpath import Operation as Operation
    from fiveaxis.toolpath import Tool as Tool
    from fiveaxis.toolpath import Toolpath as Toolpath
    from fiveaxis.verification import Against as Against
    from fiveaxis.verification import Report as Report
    from fiveaxis.verification import verify as verify
    from fiveaxis.viewer import preview as preview

__version__: str

_ROOMS = {
    "batch": ("compare", "run_batch"),
    "contour": ("find_contacts", "plan_contour"),
    "energy": ("Energy", "PowerSurface", "calibrate_drive", "power_surface"),
    "errors": ("FiveAxisError",),
    "findings": ("Finding",),
    "job": (
        "Solution",
        "cutting_power",
        "optimise",
        "post_program",
        "program_energy",
        "revise_program",
        "verify_program",
        "write_program",
    ),
    "machine": ("Machine", "load_machine", "machine_names"),
    "motion": ("Motion",),
    "nc": ("ProgramSettings", "read_operations", "read_program", "read_toolpath"),
    "report": ("location_surface", "path_valley", "tip_surface"),
    "toolpath": ("Operation", "Tool", "Toolpath"),
    "verification": ("Against", "Report", "verify"),
    "viewer": ("preview",),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("fiveaxis")
    if name not in _HOMES:
        raise AttributeError(f"module 'fiveaxis' has no attribute {name!r}")
    return getattr(import_module(f"fiveaxis.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
