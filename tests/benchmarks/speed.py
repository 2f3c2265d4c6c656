"""Print how quick each step is, as rates on this machine.

Usage: python tests/benchmarks/speed.py [first-run]        (only what the first run compiles)
"""

import os
import resource
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
from scipy.interpolate import make_interp_spline

import fiveaxis as fx
from fiveaxis.base import Workpiece
from fiveaxis.cam import Mesh, TriangleTree, load_mesh, path_quality
from fiveaxis.check import Surroundings, Tolerances
from fiveaxis.check.verification.check_context import make_context
from fiveaxis.check.verification.collisions import check_collisions
from fiveaxis.check.verification.cutting_body import CuttingBody
from fiveaxis.job import make_job, resolve
from fiveaxis.job.setup_search import search_setups
from fiveaxis.model import Constraints, Limits, Motion, axis_positions, parse_tool, time_motion, tool_poses
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.motion.thinning import thinned
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.nc import DIALECTS, compose_program
from fiveaxis.nc.languages.choice import KLARTEXT, SINUMERIK
from fiveaxis.nc.source import Source
from fiveaxis.posture import Options, optimise_postures
from fiveaxis.posture.baselines.catalogue import find_baselines
from fiveaxis.posture.local.rows import ChainModel, build_rows
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.turns.rewinding import insert_rewinds
from fiveaxis.show import ReportDocument
from fiveaxis.show.report.page import compose_page
from fiveaxis.show.viewer.page import render_page

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
POSES = 1_000_000
BLOCKS = 100_000
TILT = Constraints.of_degrees(tilt=(15, 75))


def rate(what: str, count: int, step: Callable[[], object]) -> None:
    step()  # compilers and caches
    started = time.perf_counter()
    step()
    print(f"{what:45} {count / (time.perf_counter() - started):12,.0f} /s")


def time_command(what: str, *words: str) -> None:
    """A whole command in seconds of processor: a first run, and one after it."""
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "fiveaxis.cli", *words, "-o", str(Path(folder) / "out")]
        spent = []
        for _ in range(2):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            kept = os.environ | {"NUMBA_CACHE_DIR": str(Path(folder) / "compiled")}
            subprocess.run(command, env=kept, check=True, capture_output=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    first, second = spent
    print(f"{what + ', whole command':45} {second:12.1f} s of processor")
    print(f"{'the same for the first time, more':45} {first - second:12.1f} s of processor")


def time_locations(vase: fx.Toolpath, machine: fx.Machine) -> None:
    """The locations' model, and how many times as long CasADi's own evaluator takes for the same."""
    problem = Problem.build(vase, machine, TILT.lean_bounds(vase))
    rows = build_rows(problem)
    model, chain = problem.model, ChainModel(rows)
    n, draw = len(vase), np.random.default_rng(0)
    rotary, weights = draw.uniform(-1.0, 1.0, (n, 50, 2)), draw.normal(size=(n, rows.count))
    every, first = np.arange(n), rotary[:, 0]
    rate("axis values and leans, postures", 50 * n, lambda: model.placed(every, rotary))
    rate("quantities and derivatives, locations", n, lambda: chain.derivatives(first, weights))
    mapped, given = model.tapes.function.map(n), np.hstack([first, model.given]).T
    taken = []
    for evaluate in (lambda: chain.values(first), lambda: mapped(given)):
        evaluate()  # compilers and caches
        before = time.process_time()
        for _ in range(50):
            evaluate()
        taken.append(time.process_time() - before)
    print(f"{'quantities by CasADi itself':45} {taken[1] / taken[0]:12.1f} times as long")


def time_optimiser(vase: fx.Toolpath, hayashi: fx.Machine) -> None:
    """The optimiser on the vase as a rate of processor, and how many times as long other cases take."""
    trt = fx.load_machine("linuxcnc-xyzac-trt").with_drives_of(hayashi)
    torus = fx.read_toolpath(DATA / "cases" / "vase_overhang.csv", tool=parse_tool("bull:10:2"))
    plain = 0.0
    for what, path, machine, options in (
        ("vase, locations", vase, hayashi, Options()),
        ("the same by travel", vase, hayashi, Options(objective="travel")),
        ("the same with a bull nose", torus, hayashi, Options()),
        ("the same with speeds and accelerations", vase, trt, Options()),
    ):
        spent = []
        for _ in range(2):  # compilers and caches
            before = time.process_time()
            optimise_postures(path, machine, TILT, options)
            spent.append(time.process_time() - before)
        plain = plain or spent[1]
        shown = f"{len(path) / plain:12,.0f} /s of processor" if what.startswith("vase") else ""
        print(f"{what:45} {shown or f'{spent[1] / plain:12.1f} times as long'}")


def time_languages() -> None:
    """Blocks of control languages, without what they mean: the interpreter is one for all."""
    angle = np.linspace(0.0, 600.0, BLOCKS)
    rows = np.column_stack([50.0 * np.sin(angle), 50.0 * np.cos(angle), 0.01 * angle, 0.1 * angle, angle])
    for what, split, template in (
        ("Sinumerik, blocks with angles", SINUMERIK.split, "N10 X{:.3f} Y{:.3f} Z{:.3f} A{:.3f} C{:.3f}"),
        (
            "Sinumerik, blocks with vectors",
            SINUMERIK.split,
            "N10 X{:.3f} Y{:.3f} Z{:.3f} A3={:.6f} C3={:.6f}",
        ),
        ("Klartext, L blocks", KLARTEXT.split, "10 L X{:+.3f} Y{:+.3f} Z{:+.3f} A{:+.3f} C{:+.3f}"),
        ("Klartext, LN blocks", KLARTEXT.split, "10 LN X{:+.3f} Y{:+.3f} Z{:+.3f} TX{:+.6f} TZ{:+.6f} F500"),
    ):
        source = Source("synthetic", [template.format(*row) for row in rows.tolist()])
        rate(what, BLOCKS, lambda split=split, source=source: deque(split(source), maxlen=0))


def time_programs(machine: fx.Machine) -> None:
    """Whole programs, from file to record: positions of axes, the tip under tip control, other languages."""
    tool = fx.Tool.ball(6)
    rows = np.random.default_rng(0).uniform(-1.0, 1.0, (BLOCKS, 5)) * [10.0, 10.0, 10.0, 10.0, 30.0]
    words = "N{} G1 X{:.3f} Y{:.3f} Z{:.3f} A{:.3f} C{:.3f} F1000"
    lines = [words.format(i, *row) for i, row in enumerate(rows.tolist())]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "synthetic.ngc"
        for what, head in (("axes", ""), ("tip", "M428")):
            path.write_text("\n".join(["G21 G90 G94", head, "G0 X0 Y0 Z0 A0 C0", *lines]), encoding="utf-8")
            rate(
                f"G-code of the {what} as a path, blocks",
                BLOCKS,
                lambda: fx.read_toolpath(path, tool=tool, machine=machine),
            )
        path.write_text("\n".join(["G21 G90 G94", "G0 X0 Y0 Z0 A0 C0", *lines]), encoding="utf-8")
        rate("G-code as a motion, blocks", BLOCKS, lambda: fx.read_program(path, machine))
        vectors = rows[:, :3] / 100.0 + [0.0, 0.0, 1.0]
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
        for what, name, head, words, values in (
            (
                "Sinumerik with vectors",
                "synthetic.mpf",
                "G710 G90\nTRAORI\nG0 X0 Y0 Z0 A3=0 B3=0 C3=1\nG1 F1000",
                "X{:.3f} Y{:.3f} Z{:.3f} A3={:.6f} B3={:.6f} C3={:.6f}",
                np.hstack([rows[:, :3], vectors]),
            ),
            (
                "Klartext with angles",
                "synthetic.h",
                "BEGIN PGM p MM\nM128\nL X+0 Y+0 Z+0 A+0 C+0 R0 FMAX",
                "L X{:+.3f} Y{:+.3f} Z{:+.3f} A{:+.3f} C{:+.3f} F1000",
                rows,
            ),
        ):
            path = Path(folder) / name
            path.write_text("\n".join([head, *(words.format(*row) for row in values.tolist())]))
            rate(
                f"{what} as a path, blocks",
                BLOCKS,
                lambda path=path: fx.read_toolpath(path, tool=tool, machine=machine),
            )


def time_writing(machine: fx.Machine) -> None:
    """Whole programs of every control, from motion to text."""
    turn = np.linspace(0.0, 600.0, BLOCKS)
    positions = np.column_stack(
        [50.0 * np.sin(turn), 50.0 * np.cos(turn), 0.01 * turn, 0.2 * np.sin(turn) - 0.3, turn]
    )
    flat = np.ones(BLOCKS)
    motion = Motion(
        machine.letters, positions, 10.0 * flat, 0.02 * flat, 0 * flat.astype(int), np.arange(BLOCKS)
    )
    for control, dialect in DIALECTS.items():
        for coordinates in dialect.modes:
            rate(
                f"{control} by {coordinates}, blocks written",
                BLOCKS,
                lambda control=control, coordinates=coordinates: (
                    compose_program(motion, machine=machine, control=control, coordinates=coordinates).text
                ),
            )


def time_strategies(part: Path) -> None:
    """Plan the propeller in every way that there is, with the gouge check, and measure a plan."""
    tool = fx.Tool.ball(4)
    for what, options in {
        "waterlines": {},
        "waterlines, scallop 0.02 mm": {"scallop": 0.02},
        "raster": {"strategy": "raster"},
        "raster, scallop 0.02 mm": {"strategy": "raster", "raster_angle": 30.0, "scallop": 0.02},
        "spirals": {"spiral": True},
        "islands": {"order": "islands"},
        "islands, zigzag, leads": {
            "order": "islands",
            "direction": "zigzag",
            "lead_in": 1.0,
            "lead_out": 1.0,
        },
        "overhangs, islands, zigzag": {"overhang": True, "order": "islands", "direction": "zigzag"},
    }.items():
        planned = fx.plan_contour(part, tool, **options)
        rate(f"planner, {what}", len(planned), lambda options=options: fx.plan_contour(part, tool, **options))
        links = planned.lengths[~planned.cutting].sum()
        print(f"{'':45} {len(planned):,} locations, links {links:,.0f} mm")
    planned = fx.plan_contour(part, tool)
    rate("ridges and chords, locations", len(planned), lambda: path_quality(planned, part))


def time_rewinds(hayashi: fx.Machine) -> None:
    """A helix of 1 000 turns on a C of one turn: each turn is cut at the seam and turned back."""
    n = 100_000
    angle = np.arange(n) * np.radians(3.6)
    normal = np.stack([-np.sin(angle), np.cos(angle), np.zeros(n)], axis=1)
    contact = 20.0 * normal + np.outer(np.arange(n) * 5e-4, [0.0, 0.0, 1.0])
    path = fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(6))
    limits = Limits(0.0, 2.0 * np.pi)
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in hayashi.axes)
    rotary = np.stack([angle, np.full(n, np.radians(-45.0))], axis=1)
    machine, bounds = replace(hayashi, axes=axes), TILT.lean_bounds(path)
    insert_rewinds(path.at(np.arange(200)), machine, rotary[:200])
    rate("rewinds of 1 000 turns, locations", n, lambda: insert_rewinds(path, machine, rotary, tilt=bounds))


def time_collisions(part: Path, hayashi: fx.Machine) -> None:
    """Shank and holder against the propeller, as it is and with four triangles for each, all the way."""
    holder = Holder(70.0, (Section(20.0, 20.0, 30.0), Section(40.0, 40.0)))
    tool = fx.Tool.ball(4, shank_diameter=3.0, holder=holder)
    planned = fx.plan_contour(part, tool, stepdown=8)
    solution = fx.optimise(planned, hayashi, tilt=(15, 75), effort="quick")
    path = solution.toolpath
    context = make_context(solution.motion, hayashi, path, None, Tolerances())
    mesh = Surroundings.of(Workpiece(part=part)).part
    for solid in (mesh, Mesh(*trimesh.remesh.subdivide(mesh.vertices, mesh.faces))):
        around = Surroundings(solid)
        rate(
            f"collisions, {len(solid.faces):,} triangles, locations",
            len(path),
            lambda around=around: check_collisions(context, around),
        )
        bad = sum(len(result.rows) for result in check_collisions(context, around))
        print(f"{'':45} {len(path):,} locations, {bad:,} findings")


def time_gouges(part: Path) -> None:
    """Depths of cutters on a mesh at places where they touch it, and whole checks along a path."""
    mesh = load_mesh(part, allow_open=True)
    tree = TriangleTree.build(np.asarray(mesh.triangles, dtype=float))
    planned = fx.plan_contour(part, fx.Tool.ball(4), stepdown=5)
    cuts = np.isfinite(planned.normal).all(axis=1)
    normal, centre = planned.normal[cuts], planned.pivot[cuts]
    for name in ("ball:4", "flat:4", "bull:4:1", "taper:2:5:4", "barrel:4:50:1"):
        tool = parse_tool(name)
        body = CuttingBody.of(tool)
        # With the heart where the ball's centre was, the cutter is about as near to the surface.
        tips, floors = centre - body.heart * normal, np.full(len(normal), -0.5)
        what = f"depth in {len(mesh.faces)} triangles, {name}"
        rate(what, len(tips), lambda b=body, t=tips, f=floors: b.depths(t, normal, tree, f))


def time_setups() -> None:
    """Time setups looked at roughly, on some of the path's locations."""
    search = {"x": (-60.0, 60.0), "y": (-60.0, 60.0), "tries": 10}
    case = DATA / "cases" / "vase_overhang.csv"
    job = make_job(
        input=case, machine="hayashi-640123", tool="ball:10", tilt=(15, 75), setup={"search": search}
    )
    task = resolve(job)
    rate("setups of the vase, looked at roughly", 10, lambda: search_setups(task, task.job.setup.search))


def waving_blocks(n: int) -> Motion:
    """Blocks of 0.3 mm on a random curve of all axes."""
    steps = np.random.default_rng(0).normal(size=(n // 60, 5)) * [8.0, 8.0, 8.0, 0.1, 0.1]
    points = np.cumsum(steps, axis=0)
    lengths = np.linalg.norm(np.diff(points, axis=0) * [1.0, 1.0, 1.0, 10.0, 10.0], axis=1)
    rows = make_interp_spline(np.append(0.0, np.cumsum(lengths)), points, 5)(
        np.linspace(0.0, lengths.sum(), n)
    )
    times, none = np.append(0.0, np.full(n - 1, 1e-4)), np.zeros(n, dtype=np.int64)
    return Motion("XYZAC", rows, np.full(n, 100.0), times, none, np.arange(n))


def main() -> None:
    time_command("overhang", "optimise", str(ROOT / "examples" / "overhang" / "job.toml"))
    if sys.argv[1:] == ["first-run"]:
        return
    aside = ("--tool", "ball:10", "--tilt", "15:75", "-m", "hayashi-640123")
    time_command("vase", "optimise", str(DATA / "cases" / "vase_overhang.csv"), *aside)
    machine = fx.load_machine("linuxcnc-xyzac-trt")
    positions = np.random.default_rng(0).uniform(-1.0, 1.0, (POSES, 5))
    tip, axis = tool_poses(machine, positions)
    rate("forward kinematics, poses", POSES, lambda: tool_poses(machine, positions))
    rate("inverse kinematics, poses (both branches)", POSES, lambda: axis_positions(machine, tip, axis))

    apt = DATA / "toolpaths" / "nx_ust_a2.cls.gz"
    tool = fx.Tool.ball(10)
    rate("APT, GOTO", 20_057, lambda: fx.read_toolpath(apt, tool=tool))
    arcs = DATA / "toolpaths" / "solidworks_boss_3axis.apt"
    rate("APT with 1 026 arcs, statements", 12_427, lambda: fx.read_toolpath(arcs, tool=tool, operation=1))
    time_languages()
    time_programs(machine)
    time_writing(fx.load_machine("hayashi-640123"))
    part = DATA / "meshes" / "propeller_d.stl"
    planned = fx.plan_contour(part, fx.Tool.ball(4), stepdown=5)
    rate("planner, locations", len(planned), lambda: fx.plan_contour(part, fx.Tool.ball(4), stepdown=5))
    time_strategies(part)
    time_collisions(part, fx.load_machine("hayashi-640123"))

    vase = fx.read_toolpath(DATA / "cases" / "vase_overhang.csv", tool=tool)
    hayashi = fx.load_machine("hayashi-640123")
    time_rewinds(hayashi)
    time_setups()
    bounds = TILT.lean_bounds(vase)
    rate("baselines of the vase, locations", 3600, lambda: find_baselines(vase, hayashi, bounds))
    time_locations(vase, hayashi)
    time_optimiser(vase, hayashi)
    solution = fx.optimise(vase, hayashi, tilt=(15, 75))
    rate("time law, locations", 3600, lambda: time_motion(solution.motion, machine, corners=0.01))
    jerky = tuple(replace(axis, max_jerk=10.0 * axis.max_acceleration) for axis in machine.axes)
    limited = replace(machine, axes=jerky)
    rate("time law with jerk, locations", 3600, lambda: time_motion(solution.motion, limited, corners=0.01))
    waves = waving_blocks(20_000)
    rate("time law with jerk, blocks of a curve", 20_000, lambda: time_motion(waves, limited, corners=0.005))
    path, angles = solution.toolpath, solution.motion.positions[:, hayashi.rotary_columns]
    # Every tenth location: rotary axes turn so far that blocks are inserted, some in the tool axis's plane.
    few = np.arange(0, len(path), 10)
    rate("inserted blocks, locations", 3600, lambda: fill_in(path, hayashi, angles))
    rate("inserted blocks of far turns, locations", 360, lambda: fill_in(path.at(few), hayashi, angles[few]))
    rate("needless blocks, locations", 3600, lambda: thinned(path, hayashi, solution.motion))
    rate("verify, locations", 3600, lambda: fx.verify(solution.motion, hayashi, path, tilt=(15, 75)))
    rate("preview page with a baseline, locations", 3600, lambda: render_page(solution))
    document = ReportDocument(solution, fx.verify(solution.motion, hayashi, path, tilt=(15, 75)))
    rate("report page with its figures, locations", 3600, lambda: compose_page(document))
    bounds_of = {"tilt": (15, 75), "max_turn": 15, "turn_rate": 5, "singular_cone": 5}
    rate(
        "verify, every bound, locations", 3600, lambda: fx.verify(solution.motion, hayashi, path, **bounds_of)
    )
    with TemporaryDirectory() as folder:
        file = Path(folder) / "vase.ngc"
        rate("program made, read back, verified, locations", 3600, lambda: solution.write(file))
        rate("verify a program, blocks", 3600, lambda: fx.verify_program(file, hayashi))
        rate(
            "verify a program against its path, blocks",
            3600,
            lambda: fx.verify_program(file, hayashi, toolpath=vase, tilt=(15, 75)),
        )


if __name__ == "__main__":
    main()
