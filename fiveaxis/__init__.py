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

TYPE_CHECKING = False  # `typing` takes most of the import's time
if TYPE_CHECKING:
    from typing import Any

    from fiveaxis.batch import compare, run_batch
    from fiveaxis.contour import find_contacts, plan_contour
    from fiveaxis.energy import Energy, PowerSurface, calibrate_drive, power_surface
    from fiveaxis.errors import FiveAxisError
    from fiveaxis.findings import Finding
    from fiveaxis.job import (
        Solution,
        cutting_power,
        post_program,
        program_energy,
        revise_program,
        verify_program,
        write_program,
    )
    from fiveaxis.machine import Machine, load_machine, machine_names
    from fiveaxis.motion import Motion
    from fiveaxis.nc import ProgramSettings, read_operations, read_program, read_toolpath
    from fiveaxis.report import location_surface, path_valley, tip_surface
    from fiveaxis.toolpath import Operation, Tool, Toolpath
    from fiveaxis.verification import Against, Report, verify
    from fiveaxis.viewer import preview

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

__all__ = [
    "Against",
    "Energy",
    "Finding",
    "FiveAxisError",
    "Machine",
    "Motion",
    "Operation",
    "PowerSurface",
    "ProgramSettings",
    "Report",
    "Solution",
    "Tool",
    "Toolpath",
    "calibrate_drive",
    "compare",
    "cutting_power",
    "find_contacts",
    "load_machine",
    "location_surface",
    "machine_names",
    "optimise",
    "path_valley",
    "plan_contour",
    "post_program",
    "power_surface",
    "preview",
    "program_energy",
    "read_operations",
    "read_program",
    "read_toolpath",
    "revise_program",
    "run_batch",
    "tip_surface",
    "verify",
    "verify_program",
    "write_program",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("fiveaxis")
    if name not in _HOMES:
        raise AttributeError(f"module 'fiveaxis' has no attribute {name!r}")
    return getattr(import_module(f"fiveaxis.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
