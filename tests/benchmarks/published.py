"""Hold results against those that others printed: travel on printed layers, times on test curves, energy.

Usage: python tests/benchmarks/published.py [zhang] [times] [energy] [bound] [--effort quick]
           [--page]    write the tables of docs/pages/research, published.md and results.md

Paths and the authors' figures are read from ../shared/data/published, whose README has their sources.
Travel is that of both rotary axes; lean is counted from the printed tool axis, at the given locations. Times
are those of a program in axis words, with corners passed within 5 µm. `zhang` and `bound` take some ten
minutes each.
"""

import argparse
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from paths import DATA, HAYASHI, ROOT

import fiveaxis as fx
from fiveaxis.base import angle_between
from fiveaxis.model import Axis
from fiveaxis.model.machine.drives import DirectionalDrive
from fiveaxis.posture import bound_travel

FOLDER = DATA / "published"
PAGES = ROOT / "docs/pages/research"
# The page of each table.
PAGE = {"zhang": "results.md", "times": "published.md", "energy": "published.md", "bound": "published.md"}
# Where a table of the page stands.
PLACE = r"(?<=<!-- {0} -->\n).*?(?=<!-- end of {0} -->)"
# Layers of Zhang et al. (RA-L 2021), each with the largest lean of the authors' own postures, deg.
LAYERS = {"simple_curve_10": 6.0, "simple_curve_8": 9.9, "model_1_10": 12.2}
# Share of a mean lean at which the next, narrower cone aims.
AIM = 0.98
# Angles about the printed tool axis in which times are minimised, deg.
CONES = (2.0, 15.0)
# Where drives have no part in it, each W per rad/s makes a J of a rad.
UNIT = DirectionalDrive(1.0, 1.0, proportional=True)
NOTHING = DirectionalDrive(1e-9, 1e-9, proportional=True)


@dataclass(frozen=True)
class Travel:
    """Travel and lean of postures.

    Parameters
    ----------
    degrees : of both rotary axes
    mean, median, largest : deg, lean from the printed tool axis; NaN where it isn't measured
    off : mm, by which the ball's centre leaves its place, likewise
    """

    degrees: float
    mean: float = np.nan
    median: float = np.nan
    largest: float = np.nan
    off: float = np.nan


def layer(name: str) -> tuple[fx.Toolpath, fx.Machine]:
    """Read a layer's waypoints and tool axes, and the authors' machine."""
    path = fx.read_toolpath(FOLDER / f"zhang_{name}.csv", tool=fx.Tool.ball(1), feed_mm_min=1500)
    return path, fx.load_machine(FOLDER / "zhang.toml")


def travel_of(angles: np.ndarray) -> float:
    """Sum how far angles, (n, 2) rad, turn; deg."""
    return float(np.degrees(np.abs(np.diff(angles, axis=0)).sum()))


def authors(name: str, path: fx.Toolpath) -> Travel:
    """Measure the authors' postures: ``Rz(−C) Ry(−B) z`` is the tool axis in the part."""
    b, c = np.radians(np.loadtxt(FOLDER / f"zhang_{name}_authors.csv", delimiter=",", skiprows=1)).T
    axis = np.stack([-np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)], axis=1)
    return Travel(travel_of(np.stack([b, c], axis=1)), *leans(axis, path))


def ours(found: fx.Solution, path: fx.Toolpath) -> Travel:
    """Measure a result on the locations of its program, and its lean at the given ones."""
    machine, motion = found.machine, found.motion
    tip, axis = machine.forward(motion.positions[motion.given])
    off = np.linalg.norm(tip + path.tool.radius * axis - path.pivot, axis=1)
    turned = travel_of(motion.positions[:, machine.rotary_columns])
    return Travel(turned, *leans(axis, path), float(off.max()))


def leans(axis: np.ndarray, path: fx.Toolpath) -> tuple[float, float, float]:
    """Return mean, median and largest angle of tool axes, (n, 3), to the printed ones; deg."""
    lean = np.degrees(angle_between(axis, path.axis))
    return float(lean.mean()), float(np.median(lean)), float(lean.max())


def searched(name: str, cone: float, effort: str) -> fx.Solution:
    """Minimise the travel of a layer within a cone about the printed tool axes, deg."""
    path, machine = layer(name)
    return fx.optimise(path, machine, cone=cone, objective="travel", max_turn=180, effort=effort)


def baselines(found: fx.Solution) -> dict[str, Travel]:
    """Measure the travel of the printed tool axes, and of `greedy`."""
    columns = found.machine.rotary_columns
    turned = {name: travel_of(one.motion.positions[:, columns]) for name, one in found.compared.items()}
    return {"as printed": Travel(turned["as-programmed"]), "greedy": Travel(turned["greedy"])}


def travels(name: str, effort: str) -> dict[str, Travel]:
    """Measure a layer: as printed, the authors' postures, ours within their largest and mean lean."""
    path, _ = layer(name)
    found = searched(name, LAYERS[name], effort)
    theirs, best = authors(name, path), ours(found, path)
    cone, equal = LAYERS[name], best
    while equal.mean > theirs.mean:
        cone *= AIM * theirs.mean / equal.mean
        equal = ours(searched(name, cone, effort), path)
    rows = baselines(found)
    return {
        "as printed": rows["as printed"],
        "authors": theirs,
        "`greedy`": rows["greedy"],
        "fiveaxis, their largest lean": best,
        "fiveaxis, their mean lean": equal,
    }


def travel_table(effort: str) -> Iterator[str]:
    """Print travel; mean, median and largest lean, deg; and how far the ball's centre leaves its place."""
    off = 0.0
    for number, name in enumerate(LAYERS):
        found = travels(name, effort)
        if number == 0:
            yield f"| layer | {' | '.join(found)} |"
            yield f"|---|{'---|' * len(found)}"
        cells = [f"{one.degrees:,.0f}".replace(",", " ") for one in found.values()]
        for place, one in enumerate(found.values()):
            if np.isfinite(one.mean):
                cells[place] += f"; {one.mean:.2f}, {one.median:.2f}, {one.largest:.2f}"
        yield f"| {name} | {' | '.join(cells)} |"
        off = max(off, *(one.off for one in found.values() if np.isfinite(one.off)))
    yield ""
    yield f"The ball's centre leaves its place by at most {off:.0e} mm."


@dataclass(frozen=True)
class Curve:
    """A curve with a machine of accelerations and jerks that are printed.

    Parameters
    ----------
    file, machine : of the folder
    feed : mm/min
    jerk : by axis, mm/s³ and rad/s³
    """

    file: str
    machine: str
    feed: float
    jerk: dict[str, float]


def curves() -> dict[str, Curve]:
    """Read the jerks that are printed."""
    said = json.loads((FOLDER / "expected_time_laws.json").read_text(encoding="utf-8"))
    jcde, ijms = said["jcde2022"], said["ijms2021_fan"]
    jerk = dict.fromkeys("XYZ", jcde["jerk"]["XYZ_mm_s3"])
    jerk |= {letter: jcde["jerk"][f"{letter}_rad_s3"] for letter in "AC"}
    fan = {letter: ijms["jerk"][letter] for letter in "XYZ"}
    fan |= {letter: float(np.radians(ijms["jerk"][f"{letter}_deg_s3"])) for letter in "AC"}
    return {
        "JCDE 2022": Curve("jcde2022.csv", "jcde.toml", 6000.0, jerk),
        "IJMS 2021": Curve("ijms2021_fan_spline301.csv", "ijms.toml", 30_000.0, fan),
    }


def made(curve: Curve) -> tuple[fx.Toolpath, fx.Machine]:
    """Read a curve's poses, and its machine; drives have no part in least time, but each needs one."""
    table = np.loadtxt(FOLDER / curve.file, delimiter=",", skiprows=1)
    path = fx.Toolpath.from_tips(table[:, :3], table[:, 3:], fx.Tool.ball(1), feed_mm_min=curve.feed)
    return path, fx.load_machine(FOLDER / curve.machine).with_drives_of(fx.load_machine(HAYASHI))


def with_jerk(machine: fx.Machine, jerk: dict[str, float]) -> fx.Machine:
    """Limit the jerk of a machine's axes."""
    limits: Any = {letter: {"max_jerk": most} for letter, most in jerk.items()}
    return replace(machine, axes=tuple(replace(axis, **limits[axis.letter]) for axis in machine.axes))


def times(curve: Curve, cone: float, effort: str) -> dict[str, float]:
    """Minimise the time within a cone, deg, by what is known; s."""
    path, machine = made(curve)
    machines = {"no jerk": machine, "jerk": with_jerk(machine, curve.jerk)}
    seconds = {}
    for kind, known in machines.items():
        found = fx.optimise(path, known, cone=cone, objective="time", effort=effort)
        seconds[f"as printed, {kind}"] = found.baselines["as-programmed"].time
        seconds[f"found by {kind}, {kind}"] = found.energy.time
        if kind == "no jerk":
            blocks = found.filling.blocks(found.toolpath, machines["jerk"], found.motion)
            seconds["found by no jerk, jerk"] = found.clock(blocks, machines["jerk"]).total
    return seconds


def time_table(effort: str) -> Iterator[str]:
    """Print least times."""
    columns = ["as printed, no jerk", "found by no jerk, no jerk"]
    columns += ["as printed, jerk", "found by no jerk, jerk", "found by jerk, jerk"]
    yield f"| curve, cone | {' | '.join(f'{column}, s' for column in columns)} |"
    yield f"|---|{'---|' * len(columns)}"
    for name, curve in curves().items():
        for cone in CONES:
            found = times(curve, cone, effort)
            yield f"| {name}, {cone:g} deg | {' | '.join(f'{found[column]:.2f}' for column in columns)} |"


def energy_table() -> Iterator[str]:
    """Print the saving of the form-shaping paper beside that of a stand-in for its part."""
    sys.path.insert(0, str(ROOT / "examples/papers"))
    import form_shaping

    yield "| feed drives' energy | printed | stand-in |"
    yield "|---|---|---|"
    saved = 100.0 * form_shaping.solved().savings()["normal"]
    said = "Hayashi et al. 2018, against a CAM system; ours, against the normal"
    yield f"| {said} | −{form_shaping.SAVED:.0f} % | −{saved:.1f} % |"


def least_travel(found: fx.Solution, letters: str) -> float:
    """Bound the travel of some axes from below, whatever the others do; mm or rad."""
    axes = (replace(axis, drive=UNIT if axis.letter in letters else NOTHING) for axis in found.machine.axes)
    return bound_travel(found.toolpath, replace(found.machine, axes=tuple(axes)), found.tilt).total


def least_time(travel: float, axis: Axis) -> float:
    """Bound the time of an axis that travels at least so far, mm or rad, from rest to rest; s."""
    speed, acceleration = axis.max_speed, axis.max_acceleration
    if travel < speed**2 / acceleration:
        return float(2.0 * np.sqrt(travel / acceleration))
    return float(travel / speed + speed / acceleration)


def bound_table(effort: str) -> Iterator[str]:
    """Print certified bounds: of both rotary axes' travel on layers, of the time on curves by single axes."""
    yield "| path, cone | least | found | by |"
    yield "|---|---|---|---|"
    for name, cone in LAYERS.items():
        found = searched(name, cone, effort)
        least, travel = np.degrees(least_travel(found, "BC")), ours(found, layer(name)[0]).degrees
        yield f"| {name}, {cone:g} deg | {least:.0f} deg | {travel:.0f} deg | B + C |"
    for name, curve in curves().items():
        path, machine = made(curve)
        for cone in CONES:
            found = fx.optimise(path, machine, cone=cone, objective="time", effort=effort)
            seconds = {
                axis.letter: least_time(least_travel(found, axis.letter), axis) for axis in machine.axes
            }
            letter = max(seconds, key=seconds.__getitem__)
            yield f"| {name}, {cone:g} deg | {seconds[letter]:.2f} s | {found.energy.time:.2f} s | {letter} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=["zhang", "times", "energy", "bound"])
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--page", action="store_true", help="write the page's tables")
    given = parser.parse_args()
    if not FOLDER.exists():
        sys.exit(f"no folder {FOLDER}")
    tables = {
        "zhang": lambda: travel_table(given.effort),
        "times": lambda: time_table(given.effort),
        "energy": energy_table,
        "bound": lambda: bound_table(given.effort),
    }
    for name in given.names:
        lines = []
        for line in tables[name]():
            print(line, flush=True)
            lines.append(line)
        print(flush=True)
        if given.page:
            page = PAGES / PAGE[name]
            text, table = page.read_text(encoding="utf-8"), "\n".join(lines)
            filled = re.sub(PLACE.format(name), lambda _, table=table: f"{table}\n", text, flags=re.DOTALL)
            page.write_text(filled, encoding="utf-8")


if __name__ == "__main__":
    main()
