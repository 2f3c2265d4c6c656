"""Passes on a STEP file and on meshes made of it: normals, tilt held against the exact surface, energy.

usage: python tests/benchmarks/step_normals.py [--stepdown 12] [--quick]
"""

import argparse
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

import fiveaxis as fx
from fiveaxis.base import angle_between, perpendicular
from fiveaxis.base.errors import FiveAxisError
from fiveaxis.cam import Model, load_mesh
from fiveaxis.model import tool_poses

PART = Path(__file__).parents[3] / "shared/data/step/propeller_d.step"
BALL, TILT, MACHINE = 4.0, (15.0, 75.0), "hayashi-640123"
# mm, chord tolerances of the meshes.
MESHES = (0.1, 0.05, 0.01)
# deg: smaller overruns of the tilt are rounding.
ROUNDING = 1e-4
# mm: contacts nearer to an edge of the model's faces aren't judged.
EDGE = 0.15


def away_from_edges(exact: Model, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Check which points, (n, 3) mm, have one face all around: beside an edge another may be meant."""
    u = perpendicular(normals)
    v = np.cross(normals, u)
    own, alone = exact.nearest(points).face, np.ones(len(points), dtype=bool)
    for turn in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
        alone &= exact.nearest(points + EDGE * (np.cos(turn) * u + np.sin(turn) * v)).face == own
    return alone


def measure(name: str, part: Path, exact: Model, stepdown: float, *, optimise: bool) -> str:
    """Plan on a part, optimise, and hold the contacts' normals and the tilt against the exact surfaces."""
    begun = time.perf_counter()
    path = fx.plan_contour(part, fx.Tool.ball(BALL), stepdown=stepdown)
    seconds = time.perf_counter() - begun
    cuts = np.flatnonzero(path.cutting)
    foot = exact.nearest(path.contact[cuts])
    alone = away_from_edges(exact, path.contact[cuts], foot.normal)
    cuts, foot = cuts[alone], exact.nearest(path.contact[cuts[alone]])
    error = np.degrees(angle_between(path.normal[cuts], foot.normal))
    median, most = np.percentile(error, [50.0, 95.0])
    row = f"| {name} | {len(cuts)} | {seconds:.1f} | {median:.3f} | {most:.3f} | {error.max():.2f} "
    if not optimise:
        return row + "|"
    try:
        solution = fx.optimise(path, fx.load_machine(MACHINE), tilt=TILT, effort="quick")
    except FiveAxisError as fault:
        return row + f"| {fault} |"
    given = solution.toolpath
    # Rows put in between have no planned contact.
    apart, _ = cKDTree(path.contact[cuts]).query(np.nan_to_num(given.contact, nan=1e9))
    rows = np.flatnonzero(given.cutting & (apart < 1e-6))
    normal = exact.nearest(given.contact[rows]).normal
    _, axis = tool_poses(solution.machine, solution.motion.positions)
    lean = np.degrees(angle_between(axis[rows], normal))
    over = np.maximum(TILT[0] - lean, lean - TILT[1])
    count = int((over > ROUNDING).sum())
    return row + f"| {count} of {len(rows)} | {max(over.max(), 0.0):.2f} | {solution.energy.total:.1f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stepdown", type=float, default=12.0, help="mm")
    parser.add_argument("--quick", action="store_true", help="only plan")
    given = parser.parse_args()
    begun = time.perf_counter()
    exact = load_mesh(PART).model
    assert exact is not None
    print(f"{len(exact.faces)} faces read in {time.perf_counter() - begun:.1f} s; mesh within "
          f"{exact.deviation:.4f} mm")  # fmt: skip
    heads = "part", "contacts judged", "planned in s", "normals off, median deg", "95 % deg", "most deg"
    heads += () if given.quick else ("tilt violated", "by most deg", "energy J")
    print("|", " | ".join(heads), "|")
    print("|" + "---|" * len(heads))
    with tempfile.TemporaryDirectory() as folder:
        parts = {"STEP": PART}
        for tolerance in MESHES:
            parts[f"STL, {tolerance:g} mm"] = file = Path(folder) / f"{tolerance:g}.stl"
            coarse = load_mesh(PART, mesh_tolerance=tolerance)
            trimesh.Trimesh(coarse.vertices, coarse.faces).export(file)
        for name, part in parts.items():
            print(measure(name, part, exact, given.stepdown, optimise=not given.quick), flush=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    child = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"memory at most {peak:.0f} MB here, {child:.0f} MB in the reader")


if __name__ == "__main__":
    main()
