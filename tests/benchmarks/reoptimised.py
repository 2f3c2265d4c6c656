"""Print what becomes of programs that are revised in their own lines: before, after, and what is left alone.

Usage: python tests/benchmarks/reoptimised.py [NAME …] [--ways] [--allow slower,rougher] [--effort quick]

Each row is an operation; `--ways` lists all postures that were found for it by the search that found them.
Time, starts and reversals and energy are those of whole operations, approach and retract included, by the
function behind `fiveaxis energy`. Names are those of `CASES`, of ``shared`` (the programs of
../shared/data/programs and the public ones) and of the five controls; by default all.

A control's five programs are made here as a CAM system would post them: five paths with a fixed lead and lean
or along the surface normal.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paths import DATA, PATHS

import fiveaxis as fx
from fiveaxis.base.errors import FiveAxisError
from fiveaxis.job import make_job, revise_operations
from fiveaxis.job.program_choice import events
from fiveaxis.job.revised_program import NOT_CHOSEN, Part
from fiveaxis.model import Energy

CONTROLS = ("fanuc", "haas", "heidenhain", "linuxcnc", "sinumerik")
POSTED = {
    "vase": "lead-lean",
    "wall": "normal",
    "dome-top": "normal",
    "example": "lead-lean",
    "arc": "lead-lean",
}
# Lines of LinuxCNC's impeller that are taken, and of its end.
FIRST, LAST = 300, 9


@dataclass(frozen=True)
class Program:
    """A program and the settings of its job; of some files the first and last `lines` are taken."""

    file: Path
    settings: Mapping[str, Any]
    lines: tuple[int, int] | None = None
    reading: Mapping[str, Any] = field(default_factory=dict)


PROGRAMS, TOOLPATHS = DATA / "programs", DATA / "toolpaths"
TRUNNION = {"machine": "linuxcnc-xyzac-trt", "tool": "ball:6", "cone": 15.0}
SHARED = {
    "dome": Program(
        PROGRAMS / "dome_good_already.nc", {"machine": "hayashi-640123", "tool_length": 120.0, "cone": 20.0}
    ),
    "three-tools": Program(
        PROGRAMS / "three_tools.nc", {"machine": str(PROGRAMS / "three_tools_machine.toml"), "cone": 20.0}
    ),
    "fan": Program(
        PROGRAMS / "fan_good_already.nc", {"machine": str(PROGRAMS / "fanuc_machine.toml"), "cone": 15.0}
    ),
    "axis-words": Program(
        PROGRAMS / "fanuc_mixed_axes.nc",
        {"machine": str(PROGRAMS / "fanuc_machine.toml"), "cone": 15.0, "tool": "ball:6"},
    ),
    "ring": Program(
        PROGRAMS / "traori_ring.mpf",
        {"machine": "hayashi-640123", "tool": "ball:8", "cone": 15.0},
        reading={"rapid": 20_000.0},
    ),
    "impeller-300": Program(TOOLPATHS / "linuxcnc_impeller_xyzac.ngc", TRUNNION, (FIRST, LAST)),
    "dmu70": Program(
        TOOLPATHS / "nx_dmu70_840d_traori_inch.mpf",
        {"machine": "dmu50ev", "tool": "ball:6", "cone": 15.0},
        reading={"operation": (4,)},
    ),
    "boat": Program(TOOLPATHS / "linuxcnc_boat_xyzac.ngc", TRUNNION),
    "impeller": Program(TOOLPATHS / "linuxcnc_impeller_xyzac.ngc", TRUNNION),
}


def posted(control: str, folder: Path) -> Iterator[tuple[str, Program]]:
    """Post five paths for a control, with the postures of a baseline."""
    for name, baseline in POSTED.items():
        path, machine = PATHS[name].make()
        tilt = {key: value for key, value in PATHS[name].options.items() if key != "max_turn"}
        found = fx.optimise(path, machine, effort="quick", **tilt)
        own = found.compared[baseline]
        as_posted = replace(found, motion=own.motion, toolpath=own.toolpath or found.toolpath)
        made = as_posted.program(control=control, coordinates="tip")
        file = folder / f"{name}-{control}{made.text.suffix}"
        made.write(file, unverified=True) if made.gate.is_open else file.write_text(made.text.text)
        tool = {"tool": str(path.tool), "machine": machine.name, "cone": 15.0}
        yield f"{control}: {name}, {baseline}", Program(file, tool, reading={"rapid": 20_000.0})


def figures(energy: Energy | None) -> str:
    """Write time, starts and reversals, and energy of an operation."""
    return f"{'?':>21}" if energy is None else f"{energy.time:8.1f} {events(energy):5d} {energy.total:8.0f}"


def compared(found: Mapping[str, Any]) -> str:
    """Write what a text changes."""
    energy = found["after"]
    told = f"{energy['time']:8.1f} {energy['starts'] + energy['reversals']:5d} {energy['total']:8.0f}"
    return f"{told}  {-100.0 * found['saved']:+6.1f} %  {' and '.join(found['trades'])}"


def tried_of(part: Part) -> list[dict[str, Any]]:
    """List all postures that were found for an operation."""
    if part.better is not None:
        return list(part.better.facts["tried"])
    chosen = None if part.outcome is None else part.outcome.chosen
    return [] if chosen is None else [{"by": name, **each.as_dict()} for name, each in chosen.tried]


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--ways", action="store_true")
    parser.add_argument("--allow", default="")
    parser.add_argument("--effort", default="quick")
    asked = parser.parse_args()
    how = {"effort": asked.effort, "allow": tuple(filter(None, asked.allow.split(",")))}
    print(f"{'program':34} {'as it was: s, events, J':>23}   {'revised':>23}   verdict")
    with tempfile.TemporaryDirectory() as folder:
        for name, program in cases(asked.names, Path(folder)):
            try:
                settings = {**how, **program.settings, "program": program.reading}
                made = revise_operations(make_job(input=taken(program, Path(folder)), **settings))
            except FiveAxisError as fault:
                print(f"{name:34} {fault}")
                continue
            for part in (part for part in made.parts if part.why != NOT_CHOSEN):
                label = name if len(made.parts) == 1 else f"{name} {part.operation.number}"
                said = part.verdict if part.verdict != "stays" else f"stays: {part.why}"
                print(f"{label:34} {figures(part.before)}   {figures(part.after)}   {said}", flush=True)
                for each in tried_of(part) if asked.ways else ():
                    print(f"  {each['by']:55} {compared(each)}")
    return 0


def cases(names: list[str], folder: Path) -> Iterator[tuple[str, Program]]:
    """Yield the programs by name that were asked for."""
    wanted = names or ["shared", *CONTROLS]
    for name in wanted:
        if name in CONTROLS:
            yield from posted(name, folder)
        elif name == "shared":
            yield from SHARED.items()
        else:
            yield name, SHARED[name]


def taken(program: Program, folder: Path) -> Path:
    """Return the file of a program, or of the lines that are taken of it."""
    if program.lines is None:
        return program.file
    lines = program.file.read_text().splitlines()
    first, last = program.lines
    file = folder / program.file.name
    file.write_text("\n".join([*lines[:first], *lines[-last:]]) + "\n")
    return file


if __name__ == "__main__":
    sys.exit(main())
