"""Print how time and memory grow: of the optimiser, of reading programs, of planning on meshes.

Usage: python tests/benchmarks/scale.py [posture] [programs] [meshes] [--passes 1 10 100] [--scan]
       [--effort quick] [--lines 1000000] [--triangles 4000000]                   (default: all three)

*posture*: the vase's wall, cut finer in so many passes of 1 000 locations, from the points to the files of a
verified program, stage by stage; passes and locations are splines through those of the printed case. With
`--scan` also a million locations in steps of 20 µm, and every tenth of them. *programs*: a five-axis motion
of so many blocks in each language, read as a motion and as a path, verified, and its energy computed.
*meshes*: a wavy body of so many triangles (binary STL): loaded, planned in 50 sections, a short path on it
optimised and verified, and one triangle more than is read refused.

Processor seconds are those that other programs on the machine disturb least. Each path, and each line of
programs and meshes, is a process of its own, whose peak memory it is; that of a stage is the peak up to its
end.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.interpolate import RectBivariateSpline

import fiveaxis as fx
from fiveaxis.cam.mesh.parsing import MOST_TRIANGLES
from fiveaxis.job import make_job
from fiveaxis.job.results import write_outcome
from fiveaxis.job.setup_choice import run_job

VASE = Path(__file__).parents[3] / "shared" / "data" / "cases" / "vase_overhang.csv"
PASSES, ROUND = 10, 360
# Locations of a pass; passes and locations of the paths in steps of 0.2 mm and 20 µm.
LOCATIONS, SCANS = 1_000, [(125, 800), (125, 8_000)]
# Rows repeated on either side, so that the spline closes.
LAP = 6


def fine_vase(passes: int, around: int) -> fx.Toolpath:
    """Cut the vase's wall in so many passes of so many locations."""
    given = np.loadtxt(VASE, delimiter=",", skiprows=1)[:, :6].reshape(PASSES, ROUND, 6)
    closed = np.concatenate([given[:, -LAP:], given, given[:, :LAP]], axis=1)
    level = np.linspace(0, PASSES - 1, passes)
    turn = np.linspace(0, ROUND, around, endpoint=False)
    columns = [
        RectBivariateSpline(np.arange(PASSES), np.arange(-LAP, ROUND + LAP), closed[:, :, k])(level, turn)
        for k in range(6)
    ]
    rows = np.stack(columns, axis=-1).reshape(-1, 6)
    normal = rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    return fx.Toolpath.from_contacts(rows[:, :3], normal, fx.Tool.ball(10))


def write_points(path: fx.Toolpath, file: Path) -> Path:
    rows = np.hstack([path.contact, path.normal])
    np.savetxt(file, rows, "%.7f", ",", header="x,y,z,nx,ny,nz", comments="")
    return file


def run(passes: int, around: int, effort: str) -> None:
    """Take a path to a verified program, and print the processor seconds and peak memory of each stage."""
    spent: dict[str, list[float]] = {}
    now, at = [""], [0.0]

    def step(stage: str, _done: int, _total: int) -> None:
        seconds = spent.setdefault(now[0], [0.0, 0.0])
        seconds[0] += time.process_time() - at[0]
        seconds[1] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        now[0], at[0] = stage.split(",")[0], time.process_time()

    # First a short path: compilers, imports and caches.
    for shape in ((1, 400), (passes, around)):
        with tempfile.TemporaryDirectory() as folder:
            file = write_points(fine_vase(*shape), Path(folder) / "path.csv")
            spent.clear()
            now[0], at[0] = "reading the input", time.process_time()
            job = make_job(input=file, machine="hayashi-640123", tool="ball:10", tilt=(15, 75), effort=effort)
            outcome = run_job(job, step)
            step("writing the files", 0, 1)
            write_outcome(outcome, Path(folder) / "out")
            step("", 0, 1)
    energy = outcome.solution.energy.total
    print(json.dumps({"locations": passes * around, "energy": energy, "ok": outcome.ok, "stages": spent}))


def posture(passes: list[int], scan: bool, effort: str) -> None:
    """Print each path's stages, and the exponents by which they grow from the smallest path."""
    found = []
    for count, around in [*((one, LOCATIONS) for one in passes), *(SCANS if scan else [])]:
        command = [sys.executable, __file__, "--run", str(count), str(around), "--effort", effort]
        said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        found.append(json.loads(said.splitlines()[-1]))
        n, stages = found[-1]["locations"], found[-1]["stages"]
        total, memory = sum(s for s, _ in stages.values()), max(m for _, m in stages.values())
        print(f"{n:,} locations, {found[-1]['energy']:.0f} J, effort {effort}, verified: {found[-1]['ok']}")
        for stage, (seconds, peak) in [*stages.items(), ("in all", (total, memory))]:
            first = found[0]["stages"].get(stage, (sum(s for s, _ in found[0]["stages"].values()),))[0]
            grown = ""
            if n != found[0]["locations"] and min(first, seconds) > 0.0:
                power = np.log(seconds / first) / np.log(n / found[0]["locations"])
                grown = f"   grows as n^{power:.2f}"
            rate = n / max(seconds, 1e-9)
            print(f"  {stage:45} {seconds:8.1f} s of processor {rate:12,.0f} /s {peak:5.2f} GB{grown}")


def child(what: str, *arguments: str) -> None:
    """Run a process and print its time and memory, and the last line that it writes."""
    clock = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert process.stdout is not None
    said = process.stdout.read().strip().splitlines()
    _, status, used = os.wait4(process.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    last = said[-1][:160] if said else "nothing was written"
    print(
        f"{what:34} {time.perf_counter() - clock:7.1f} s {used.ru_utime + used.ru_stime:7.1f} s of processor "
        f"{used.ru_maxrss / 1e6:6.2f} GB   {last}{f' (exit code {code})' if code else ''}",
        flush=True,
    )


def command(what: str, *arguments: str) -> None:
    child(what, "-c", "from fiveaxis.cli import main; main()", *arguments)


def call(what: str, code: str) -> None:
    child(what, "-c", f"import fiveaxis as fx; {code}")


# Suffix, head, block of X, Y, Z, A, C, F and number, and end of the programs.
LANGUAGES = {
    "ISO, G94": ("nc", "G21 G90 G94\nG0 A-40 C0\nG0 X60 Y0\nG0 Z30\nG1\n", "X{} Y{} Z{} A{} C{} F{}", "M30"),
    "ISO, G93": ("nc", "G21 G90 G93\nG0 A-40 C0\nG0 X60 Y0\nG0 Z30\n", "G1 X{} Y{} Z{} A{} C{} F{}", "M30"),
    "ISO, TCP": (
        "nc",
        "G21 G90 G94\nG0 A-40 C0\nG43.4 H1\nG0 X60 Y0\nG0 Z30\nG1\n",
        "X{} Y{} Z{} A{} C{} F{}",
        "M30",
    ),
    "Sinumerik": (
        "mpf",
        "G710 G90 G94\nG0 A-40 C0\nG0 X60 Y0\nG0 Z30\n",
        "N{6} G1 X{0} Y{1} Z{2} A{3} C{4} F{5}",
        "M30",
    ),
    "Klartext": (
        "h",
        "0 BEGIN PGM S MM\n1 L A-40 C+0 R0 FMAX\n2 L X+60 Y+0 R0 FMAX\n3 L Z+30 R0 FMAX\n",
        "{6} L X{0} Y{1} Z{2} A{3} C{4} F{5}",
        "END PGM S MM",
    ),
}


def write_program(folder: Path, name: str, lines: int) -> Path:
    """Write a smooth motion of five axes, of which neither position nor feed is constant."""
    suffix, head, block, end = LANGUAGES[name]
    at = np.arange(lines)
    turn = 0.01 * at
    columns = [
        *(60.0 * np.cos(turn), 60.0 * np.sin(turn), 20.0 * np.cos(0.2 * turn) - 2e-5 * at),
        *(20.0 * np.sin(0.3 * turn) - 40.0, 90.0 * np.sin(0.5 * turn), 1000.0 + 200.0 * np.sin(10.0 * turn)),
    ]
    text = [[f"{value:.4f}" for value in column] for column in columns]
    path = folder / f"program.{suffix}"
    with path.open("w") as stream:
        stream.write(head)
        stream.writelines(
            block.format(*row, 10 * i + 10) + "\n" for i, row in enumerate(zip(*text, strict=True))
        )
        stream.write(f"{end}\n")
    return path


def programs(lines: int) -> None:
    machine = "machine=fx.load_machine('hayashi-640123'), rapid=1e4"
    with tempfile.TemporaryDirectory() as folder:
        for name in LANGUAGES:
            path = write_program(Path(folder), name, lines)
            call(f"{name}, read_program", f"print(len(fx.read_program({str(path)!r}, {machine})), 'rows')")
            tool = "tool=fx.Tool.ball(6)"
            code = f"print(len(fx.read_toolpath({str(path)!r}, {tool}, {machine})), 'locations')"
            call(f"{name}, read_toolpath", code)
            command(f"{name}, fiveaxis verify", "verify", str(path), "--machine", "hayashi-640123")
            given = (str(path), "--machine", "hayashi-640123", "--rapid", "10000")
            command(f"{name}, fiveaxis energy", "energy", *given)


def wavy_body(count: int) -> np.ndarray:
    """Return the corners of a closed body of about so many triangles, (f, 3, 3) mm."""
    k = int((count / 2) ** 0.5)
    polar, around = np.linspace(0, np.pi, k + 1)[1:-1, None], np.arange(k)[None] * 2 * np.pi / k
    radius = 50 + 2 * np.sin(9 * around) * np.sin(polar) ** 2 + 1.5 * np.cos(7 * polar)
    flat = radius * np.sin(polar)
    grid = np.stack([flat * np.cos(around), flat * np.sin(around), radius * np.cos(polar)], axis=-1)
    top, bottom = np.broadcast_to([[0, 0, 51.5]], (k, 3)), np.broadcast_to([[0, 0, -48.5]], (k, 3))
    a, b = grid[:-1], grid[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    parts = [np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]
    caps = [np.stack([top, a[0], d[0]], axis=1), np.stack([b[-1], bottom, c[-1]], axis=1)]
    return np.concatenate([*(part.reshape(-1, 3, 3) for part in parts), *caps])


def write_mesh(path: Path, count: int) -> Path:
    """Write the wavy body as binary STL."""
    corners = wavy_body(count)
    found = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    found["corners"] = corners
    path.write_bytes(b"\0" * 80 + len(corners).to_bytes(4, "little") + found.tobytes())
    return path


def meshes(triangles: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        part, path = str(write_mesh(Path(folder) / "part.stl", triangles)), str(Path(folder) / "path.csv")
        large = Path(folder) / "large.stl"
        with large.open("wb") as stream:
            stream.write(b"\0" * 80 + (MOST_TRIANGLES + 1).to_bytes(4, "little"))
            stream.truncate(84 + 50 * (MOST_TRIANGLES + 1))
        call(
            "load_mesh",
            f"from fiveaxis.cam.mesh import load_mesh; print(len(load_mesh({part!r}).faces), 'triangles')",
        )
        tool = ("--tool", "ball:6")
        command("fiveaxis plan", "plan", part, *tool, "--stepdown", "2", "-o", path)
        command("fiveaxis plan, too large", "plan", str(large), *tool, "--stepdown", "2")
        command("fiveaxis plan, a short path", "plan", part, *tool, "--stepdown", "30", "-o", path)
        machine = ("--machine", "hayashi-640123")
        aside = ("--tilt", "15:75", "--effort", "quick")
        command("fiveaxis optimise --part", "optimise", path, *tool, *machine, "--part", part, *aside)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", choices=["posture", "programs", "meshes", []])
    parser.add_argument("--passes", nargs="+", type=int, default=[1, 10, 100])
    parser.add_argument("--scan", action="store_true")
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--run", nargs=2, type=int, help=argparse.SUPPRESS)
    parser.add_argument("--lines", type=int, default=1_000_000)
    parser.add_argument("--triangles", type=int, default=4_000_000)
    given = parser.parse_args()
    if given.run:
        run(*given.run, given.effort)
        return
    parts = given.parts or ["posture", "programs", "meshes"]
    if "posture" in parts:
        posture(given.passes, given.scan, given.effort)
    if "programs" in parts:
        programs(given.lines)
    if "meshes" in parts:
        meshes(given.triangles)


if __name__ == "__main__":
    main()
