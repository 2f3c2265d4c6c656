"""Print the operations of the public programs in `../shared/data/toolpaths` as `fiveaxis info` lists them.

Usage: python tests/benchmarks/operations.py

Locations include those that are inserted in arcs; mm are those of the tip on the workpiece in feed moves.
"""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from support.haas_trunnion import haas_trunnion  # noqa: E402

import fiveaxis as fx  # noqa: E402
from fiveaxis.nc import measure_operations  # noqa: E402
from fiveaxis.nc.options import ProgramReading  # noqa: E402

DATA = ROOT.parent / "shared" / "data" / "toolpaths"
OFFSETS = ("G54", "G55", "G56", "G57", "G59", "G54.1P1", "G54.1P2", "G54.1P3")


@dataclass(frozen=True)
class Public:
    """A program, and what it doesn't state.

    Parameters
    ----------
    name : of its file
    about : what it is
    machine : name of one with its rotary axes; None for the Haas trunnion, empty where it needs none
    reading : as for `measure_operations`
    """

    name: str
    about: str
    machine: str | None = ""
    reading: Mapping[str, Any] = field(default_factory=dict)


PROGRAMS = (
    Public("linuxcnc_boat_xyzac.ngc", "LinuxCNC, a boat's hull", "linuxcnc-xyzac-trt"),
    Public("linuxcnc_impeller_xyzac.ngc", "LinuxCNC, an impeller", "linuxcnc-xyzac-trt"),
    Public("nx_dmu70_840d_traori_inch.mpf", "NX for a DMU 70, Sinumerik", "dmu50ev"),
    Public("nx_haas_vf2tr_machine_inch.nc", "the same part for a Haas, axis words", None, {"unit": "inch"}),
    Public(
        "nx_nmv5000_fanuc_mm.nc",
        "the same part for an NMV 5000, Fanuc; its zeros are taken to be one (`--zero`), C to begin at 0 "
        "(`--start C0`)",
        "dmu50ev",
        {"start": {"C": 0.0}, "zero": {f"{o}{c}": 0.0 for o in OFFSETS for c in "XYZBC"}},
    ),
    Public("nx_dmc160u_millplus.nc", "NX for a DMC 160 U, MillPlus", "dmu50ev"),
    Public("spinner_achskreuz_840D_mm.mpf", "Sinumerik, planes", "linuxcnc-xyzbc-trt"),
    Public("nx_ust_a.cls", "NX, a CL file"),
    Public("nx_ust_a2.cls.gz", "NX, a CL file"),
    Public("solidworks_boss_3axis.apt", "SolidWorks CAM, APT"),
)


def table_of(program: Public) -> Iterator[str]:
    """Yield the lines of a program's table."""
    machine = haas_trunnion() if program.machine is None else None
    if program.machine:
        machine = fx.load_machine(program.machine)
    yield f"## {program.name}"
    yield ""
    yield f"{program.about[0].upper()}{program.about[1:]}."
    yield ""
    yield "| | lines | tool | kind | locations | mm |"
    yield "|---|---|---|---|---|---|"
    for each in measure_operations(DATA / program.name, ProgramReading(machine=machine, **program.reading)):
        at = each.operation
        kind = at.kind + ", TCP" * at.tcp + ", plane" * (at.plane is not None)
        figures = f"{each.locations} | {each.cut_length:.0f}"
        yield f"| {at.number} | {at.first_line}-{at.last_line} | {at.tool} | {kind} | {figures} |"
    yield ""


def main() -> None:
    """Print the tables."""
    for program in PROGRAMS:
        print("\n".join(table_of(program)))


if __name__ == "__main__":
    main()
