"""Print how far programs that are read back are off their paths: by path, machine, control and mode.

Usage: python tests/benchmarks/programs.py [example] [vase] [wall] …        (default: all of `CASES`)

Each row is one program: made as `Solution.program` makes it, read back from its text, verified. *path* is the
farthest that the tool's centre or contact is from where the path wants it, at given and inserted locations;
*chord* how far the centre leaves the straight line between two of them; *axis* how far the tool axis leaves
the plane of its directions. A program with an error, and a case without a
solution, are named, and the exit code is 1 then. The last line is
the worst of all.

Machines without powers take those of a machine with plain drives, and those without room for the path reach
everything: what is measured here is the text, not the machine.
"""

import sys
from dataclasses import replace

from paths import PATHS

import fiveaxis as fx
from fiveaxis.base.errors import FiveAxisError, Infeasible
from fiveaxis.model import DirectionalDrive, Limits, Machine
from fiveaxis.nc import DIALECTS

# One machine of each structure: table-table (with and without offsets, B and A), head-table, head-head.
MACHINES = {
    "hayashi-640123": 0.0,
    "variaxis-630": 0.0,
    "umc-750": 0.0,
    "dmu80p-duoblock": 120.0,
    "linuxcnc-bridgemill": 120.0,
}
MODES = [(control, mode) for control, dialect in DIALECTS.items() for mode in dialect.modes]


TRUNNION = ("linuxcnc-xyzac-trt",)
HAYASHI = ("hayashi-640123",)
# The machines that a path is made for.
CASES = {
    "example": tuple(MACHINES),
    "vase": tuple(MACHINES),
    "wall": HAYASHI,
    "impeller": TRUNNION,
    "boat": TRUNNION,
    "propeller": HAYASHI,
    "supportless": HAYASHI,
    "featuretype": HAYASHI,
}


def with_powers(machine: Machine) -> Machine:
    """The machine with plain drives, no bodies, and linear axes that reach everything."""
    drives = {c: DirectionalDrive(40.0, 40.0) for c in "XY"} | {"Z": DirectionalDrive(600.0, 400.0)}
    turning = DirectionalDrive(200.0, 200.0, proportional=True)
    axes = tuple(
        replace(a, drive=turning) if a.is_rotary else replace(a, drive=drives[a.letter], limits=Limits())
        for a in machine.axes
    )
    return replace(machine, bodies=(), axes=axes)


def run(name: str) -> tuple[list[float], int]:
    """Print the rows of a case; give the worst figures and the number of programs with errors."""
    case, worst, bad = PATHS[name], [0.0, 0.0, 0.0], 0
    for machine_name in CASES[name]:
        machine = with_powers(fx.load_machine(machine_name)).with_tool_length(MACHINES.get(machine_name, 0.0))
        try:
            solution = fx.optimise(case.read(), machine, effort="quick", **case.options)
        except Infeasible as fault:
            print(f"{name:12} {machine_name:20} no solution: {str(fault)[:90]}")
            bad += 1
            continue
        for control, mode in MODES:
            row = f"{name:12} {machine_name:20} {control:20} {mode:7}"
            try:
                made = solution.program(control=control, coordinates=mode)
            except FiveAxisError as fault:
                print(f"{row} {str(fault)[:90]}")
                continue
            figures = made.report.figures
            keys = ("contact_error_mm", "tip_deviation_mm", "axis_off_plane_deg")
            found = [figures.get(key) or 0.0 for key in keys]
            worst = [max(pair) for pair in zip(worst, found, strict=True)]
            errors = "" if made.ok else f"  ERRORS {made.gate.kept}"
            bad += not made.ok
            path, chord, axis = found
            print(
                f"{row} {len(made.motion):6d} rows  path {1e3 * path:6.3f} um  chord {1e3 * chord:6.3f} um  "
                f"axis {axis:7.4f} deg{errors}",
                flush=True,
            )
    return worst, bad


if __name__ == "__main__":
    results = [run(case) for case in sys.argv[1:] or CASES]
    path, chord, axis = (max(worst[i] for worst, _ in results) for i in range(3))
    bad = sum(count for _, count in results)
    print(
        f"worst: path {1e3 * path:.3f} um, chord {1e3 * chord:.3f} um, axis {axis:.4f} deg; {bad} with errors"
    )
    sys.exit(bool(bad))
