"""Break the package in forty-five small ways, and print which of them its tests notice.

Usage: python tests/benchmarks/mutants.py [--part 1/2] [--only WORD…] [--under COMMAND]

Each mutant is one wrong sign, bound, limit, unit, axis or index. It is made in a copy of the repository in a
temporary folder, with nothing beside it; then the quick tests of the rooms that should notice run there, up
to the first one that fails. *killed*: one did; *SURVIVED*: none. The exit code is 1 where a mutant has
survived.
"""

import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
# s of processor time, for the tests of one mutant.
PATIENCE = 400
ROW = "{:44} {:9} {:>5}  {}"


@dataclass(frozen=True)
class Mutant:
    """A wrong line.

    Parameters
    ----------
    file : below `fiveaxis`
    what : is wrong
    old, new : text that stands once in the file, and what replaces it
    tests : folders or files below `tests`
    compiled : whether it is inside a compiled loop, so that no machine code may be taken over
    """

    file: str
    what: str
    old: str
    new: str
    tests: tuple[str, ...]
    compiled: bool = False


KINEMATICS = ("unit/model/kinematics", "property/test_kinematics.py")
MOTION = ("unit/model/motion",)
ENERGY = ("unit/model/energy",)
COLLISION = ("unit/check/collision",)
VERIFICATION = ("unit/check/verification",)
READING = ("unit/nc",)
WRITING = ("unit/nc", "golden")
CONTOUR = ("unit/cam/contour",)
STOCK = ("unit/check/stock",)
PATHS = ("unit/model/toolpath",)

MUTANTS = (
    Mutant(
        "model/kinematics/inverse.py",
        "both branches on one side",
        "np.stack([middle + spread, middle - spread])",
        "np.stack([middle + spread, middle + spread])",
        KINEMATICS,
    ),
    Mutant(
        "model/kinematics/windings.py",
        "a turn too many within the limits",
        "most = np.floor((high + ON_LIMIT - angle) / TURN)\n    turns",
        "most = np.ceil((high + ON_LIMIT - angle) / TURN)\n    turns",
        KINEMATICS,
    ),
    Mutant(
        "model/kinematics/singularity.py",
        "largest lean from the nearer limit",
        "math.pi if through_opposite else max(first, last)",
        "math.pi if through_opposite else min(first, last)",
        KINEMATICS,
    ),
    Mutant(
        "model/motion/run_time.py",
        "first row is no block of its own",
        "ends[0] = True",
        "ends[0] = False",
        MOTION,
    ),
    Mutant(
        "model/motion/timing.py",
        "rapid feed of a rotary axis in rad",
        "np.radians(feed)[:, None], feed[:, None])\n    known",
        "feed[:, None], feed[:, None])\n    known",
        MOTION,
    ),
    Mutant(
        "model/motion/timing.py",
        "axes faster than they can",
        "times = np.maximum(times, axis_times(machine, moves))",
        "times = np.minimum(times, axis_times(machine, moves))",
        MOTION,
    ),
    Mutant(
        "model/motion/limiting.py",
        "corners ahead taken for corners back",
        "(along[1:] * along[:-1]).sum(axis=1) < 0.0",
        "(along[1:] * along[:-1]).sum(axis=1) > 0.0",
        MOTION,
    ),
    Mutant(
        "model/toolpath/steps.py",
        "mean slope of several blocks by one block more",
        "total / spans[:, None] ** spread",
        "total / (spans[:, None] + 1) ** spread",
        ("unit/model/energy", "unit/posture/test_terms.py", "unit/posture/search"),
    ),
    Mutant(
        "model/toolpath/steps.py",
        "way back priced as the way there",
        'there[::-1] if given["axis"] else there',
        "there",
        ("unit/model/energy", "unit/posture/test_terms.py", "unit/posture/search"),
    ),
    Mutant(
        "lab/cutting/drilling.py",
        "thrust gives power back",
        "(torque * spindle + thrust * speed) / WATT",
        "(torque * spindle - thrust * speed) / WATT",
        ("unit/lab/cutting",),
    ),
    Mutant(
        "model/energy/totals.py",
        "torque at the start of each part, not its middle",
        "rest = 1.0 - begin - 0.5 / parts[row]",
        "rest = 1.0 - begin - 1.0 / parts[row]",
        ENERGY,
    ),
    Mutant(
        "check/collision/scene.py",
        "shank too lenient by a radius",
        "min(low + radius, high)",
        "min(low + 2.0 * radius, high)",
        (*COLLISION, "unit/check/verification/test_collisions.py"),
    ),
    Mutant(
        "check/collision/travel.py",
        "bound on the second derivative misses half the cross term",
        "(step * distance + 2.0 * moved)",
        "(step * distance + 1.0 * moved)",
        (*COLLISION, "unit/check/verification/test_collisions.py"),
    ),
    Mutant(
        "check/collision/shrinking.py",
        "a ball takes away at its end only",
        "a, b = pivot[row - 1], pivot[row]",
        "a, b = pivot[row], pivot[row]",
        COLLISION,
        compiled=True,
    ),
    Mutant(
        "check/verification/checks.py",
        "lean at locations held to the bound between them",
        "np.where(between, context.tolerances.lean_between, context.tolerances.lean)",
        "np.where(between, context.tolerances.lean, context.tolerances.lean_between)",
        VERIFICATION,
    ),
    Mutant(
        "check/verification/feeds.py",
        "F of a turn counts rad",
        "turn = np.degrees(moves.max(axis=1, initial=0.0))",
        "turn = moves.max(axis=1, initial=0.0)",
        VERIFICATION,
    ),
    Mutant(
        "check/verification/gouging.py",
        "bound on the second derivative without the cross term",
        "(step * arm + 2.0 * moved)",
        "(step * arm)",
        VERIFICATION,
    ),
    Mutant(
        "check/verification/standing.py",
        "lowest point of a circle above its centre",
        "(centres - tilted[:, None] * circles[:, 3])",
        "(centres + tilted[:, None] * circles[:, 3])",
        (*VERIFICATION, "unit/job/test_over_the_table.py"),
    ),
    Mutant(
        "check/verification/turns.py",
        "a link between cuts of one line counts as a cut",
        "(line[1:] != line[:-1]) | (cutting[1:] != cutting[:-1])",
        "(line[1:] != line[:-1])",
        VERIFICATION,
    ),
    Mutant(
        "nc/control/arcs.py",
        "the other centre of an arc by radius",
        "if clockwise == (radius > 0.0)",
        "if clockwise != (radius > 0.0)",
        READING,
    ),
    Mutant(
        "nc/control/arcs.py",
        "chords twice as far from the arc",
        "math.sqrt(share / 2.0)",
        "math.sqrt(share)",
        READING,
    ),
    Mutant(
        "nc/control/coordinates.py",
        "contained tool length with the wrong sign",
        "else -self.contained",
        "else self.contained",
        (*READING, "property/test_tool_length.py"),
    ),
    Mutant(
        "nc/apt/feedrate.py",
        "feed's own unit ignored",
        "MILLIMETRES[unit or units.now]",
        "MILLIMETRES[units.now]",
        READING,
    ),
    Mutant(
        "nc/control/feed_meaning.py",
        "a degree counts as a mm in an inch program",
        "self.table.degree * MILLIMETRES[unit]",
        "self.table.degree * 1.0",
        READING,
    ),
    Mutant(
        "nc/writing/feeds.py",
        "half the angle between directions",
        "np.degrees(2.0 * arcsin(half))",
        "np.degrees(arcsin(half))",
        WRITING,
    ),
    Mutant(
        "nc/writing/turns.py",
        "modulo words from another lower end",
        "np.remainder(degrees - low, TURN)",
        "np.remainder(degrees, TURN)",
        WRITING,
    ),
    Mutant(
        "nc/writing/turns.py",
        "reset to the nearest turn, not the first",
        "TURN * np.floor(now[columns] / TURN)",
        "TURN * np.round(now[columns] / TURN)",
        WRITING,
    ),
    Mutant(
        "nc/writing/word_writer.py",
        "directions rounded out of the limits",
        "limits.low + step, limits.high - step",
        "limits.low - step, limits.high + step",
        ("unit/job/test_program.py",),
    ),
    Mutant(
        "posture/terms.py",
        "steps back take no time",
        "for sign in (1, -1)]",
        "for sign in (1, 1)]",
        ("unit/posture/test_terms.py", "unit/posture/strategy/test_least_time.py", "unit/posture/local"),
    ),
    Mutant(
        "posture/turns/rewinding.py",
        "rewinds the other way",
        "+= TURN * rewind.turns",
        "-= TURN * rewind.turns",
        ("unit/posture/turns",),
    ),
    Mutant(
        "posture/baselines/catalogue.py",
        "lean to the other side",
        "+ np.sin(lean) * side",
        "- np.sin(lean) * side",
        ("unit/posture/baselines", "property/test_posture_laws.py"),
    ),
    Mutant(
        "posture/strategy/least_time.py",
        "stop time of a short block without the factor 2",
        "speed / push, 2.0 * root, lasting",
        "speed / push, root, lasting",
        ("unit/posture/strategy/test_least_time.py", "unit/posture/test_terms.py"),
    ),
    Mutant(
        "check/verification/release.py",
        "gate open to errors of a verified program",
        "return self.verified and not self.kept",
        "return self.verified or not self.kept",
        (
            "unit/check/verification/test_release.py",
            "unit/job/test_job.py",
            "unit/check/verification/test_verifying.py",
        ),
    ),
    Mutant(
        "job/program_choice.py",
        "as slow counts as slower",
        "(1.0 + LONGER) * self.before.time",
        "(1.0 - LONGER) * self.before.time",
        ("unit/job/test_revised_program.py", "unit/job/test_reorienting.py"),
    ),
    Mutant(
        "job/placement.py",
        "ranges of a search from the longest travel",
        "0.25 * float(travels.min())",
        "0.25 * float(travels.max())",
        ("unit/job/test_setup_choice.py", "unit/job/test_placement.py"),
    ),
    Mutant(
        "cam/contour/ordering.py",
        "an open pass begins at its farther end",
        "return found.reversed() if end < start else found",
        "return found.reversed() if end > start else found",
        CONTOUR,
    ),
    Mutant(
        "cam/contour/leaning.py",
        "shares across from the wrong end of lead",
        "np.maximum(sideways[0], square - ahead[1])",
        "np.maximum(sideways[0], square - ahead[0])",
        CONTOUR,
    ),
    Mutant(
        "check/stock/rays.py",
        "a tile ends with the last begin of its material",
        "max(high, ends[ray, 2 * count[ray] - 1])",
        "max(high, ends[ray, 2 * count[ray] - 2])",
        STOCK,
        compiled=True,
    ),
    Mutant(
        "model/toolpath/cutter.py",
        "pivot of a tip on the other side of the axis",
        "+ self.height * axis - self.offset * across(normal, axis)",
        "+ self.height * axis + self.offset * across(normal, axis)",
        PATHS,
    ),
    Mutant(
        "model/toolpath/edge.py",
        "half of each cut to the location before the wrong one",
        "np.append(half[1:], 0.0), 0.0)",
        "np.append(0.0, half[:-1]), 0.0)",
        PATHS,
    ),
    Mutant(
        "check/verification/checks.py",
        "lean within moves never beyond its bound",
        "np.nan_to_num(np.maximum(angles - one.high, one.low - angles), nan=-np.inf)",
        "np.nan_to_num(np.minimum(angles - one.high, one.low - angles), nan=-np.inf)",
        VERIFICATION,
    ),
    Mutant(
        "check/collision/obstacles.py",
        "the last solid of a tool may touch",
        "for solid in range(len(begin) - 1):",
        "for solid in range(len(begin) - 2):",
        COLLISION,
        compiled=True,
    ),
    Mutant(
        "nc/control/wrapping.py",
        "-0 turns forwards",
        "backwards = math.copysign(1.0, word) < 0.0",
        "backwards = word < 0.0",
        READING,
    ),
    Mutant(
        "base/interrupted.py",
        "later steps of threads have the names of earlier ones",
        "        self._count += 1\n        return Kept(",
        "        return Kept(",
        ("unit/job/test_unfinished.py",),
    ),
    Mutant(
        "lab/calibration/drive_fits.py",
        "noise of a log by another multiple of its median",
        "NORMAL_MAD = 1.4826",
        "NORMAL_MAD = 1.349",
        ("unit/lab/calibration",),
    ),
)


def copied(folder: Path) -> Path:
    """Copy the repository, with its machine code, to a folder."""
    known = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        check=True,
    )
    files = [Path(name.decode()) for name in known.stdout.split(b"\0") if name]
    caches = [p.relative_to(ROOT) for p in ROOT.glob("fiveaxis/**/__pycache__/*.nb*")]
    for name in files + caches:
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def is_killed(mutant: Mutant, copy: Path, under: list[str]) -> tuple[bool, str]:
    """Run a mutant's tests under another command; return whether one failed, and its name."""
    file = copy / "fiveaxis" / mutant.file
    right = copy.parent / "right"
    shutil.copy2(file, right)
    text = file.read_text(encoding="utf-8")
    if text.count(mutant.old) != 1:
        raise SystemExit(f"{mutant.file}: {mutant.old!r} stands there {text.count(mutant.old)} times")
    file.write_text(text.replace(mutant.old, mutant.new), encoding="utf-8")
    with tempfile.TemporaryDirectory() as machine_code:
        environment = os.environ | {"PYTHONPATH": str(copy)}
        environment |= {"NUMBA_CACHE_DIR": machine_code} if mutant.compiled else {}
        tests = [f"tests/{name}" for name in mutant.tests]
        command = [*under, sys.executable, "-m", "pytest", "-x", "-m", "not slow", "-p", "no:cacheprovider"]
        try:
            run = subprocess.run(
                [*command, *tests],
                cwd=copy,
                env=environment,
                capture_output=True,
                text=True,
                check=False,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE)),
            )
        finally:
            # With its time, for which the machine code was made.
            shutil.copy2(right, file)
    if run.returncode < 0:
        return True, "no end"
    if run.returncode not in (0, 1):
        raise SystemExit(f"{mutant.file}: pytest ended with {run.returncode}:\n{run.stdout}")
    failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", run.stdout, re.MULTILINE)
    return run.returncode == 1, failed[1] if failed else ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", default="1/1", help="1/2 and 2/2 are the halves, for two processes")
    parser.add_argument("--only", nargs="*", default=[], help="words of file or description")
    parser.add_argument("--under", nargs=1, default=[], help="a command that runs others, such as nice")
    given = parser.parse_args()
    part, parts = map(int, given.part.split("/"))
    chosen = [m for m in MUTANTS if not given.only or any(w in f"{m.file} {m.what}" for w in given.only)]
    survived = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = copied(Path(folder) / "alone" / "main")
        for mutant in chosen[part - 1 :: parts]:
            begin = time.perf_counter()
            killed, by = is_killed(mutant, copy, given.under)
            survived += not killed
            verdict, seconds = "killed" if killed else "SURVIVED", f"{time.perf_counter() - begin:.0f}"
            print(ROW.format(mutant.file, verdict, seconds, f"{mutant.what}: {by}"), flush=True)
    print(f"{len(chosen[part - 1 :: parts]) - survived} killed, {survived} survived")
    return int(survived > 0)


if __name__ == "__main__":
    raise SystemExit(main())
