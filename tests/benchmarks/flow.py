"""Passes along the faces of CAD files: are they on the surfaces, how high are ridges, how long does it take.

usage: python tests/benchmarks/flow.py [--scallop 0.01] [--spacing 0.5] [--quick] [--program]

*off* and *turned*: contacts and normals against the surfaces of the model, where faces meet against the best
of them; *told*: the largest ridge by `path_quality`; *99 %* and *left*: by brute force, how high material is
left above random points of the faces at which the ball has room (20 000 are drawn); *out*: contacts that no
pass reaches, which the plan's finding counts; *s*: of planning, after a first plan that compiles and loads.
With a large spacing the ball cuts deeper than asked between two contacts of a convex curve, and ridges are
lower: 0.1 shows them as they are asked. `--program` takes a blade by one command from its model to a verified
program, and ends with its exit code.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.left_over_material import left_over

import fiveaxis as fx
from fiveaxis.base import angle_between
from fiveaxis.cam import PlanOptions, load_mesh, path_quality, plan_passes

MAKER = Path(__file__).parents[1] / "support/cad_parts.py"
PROPELLER = Path(__file__).parents[3] / "shared/data/step/propeller_d.step"
# deg and mm: what is no more than rounding, and how far apart faces meet.
ROUNDING, MEETING = 1e-3, 1e-3
ROW = "{:10} {:>8} {:>5} {:>7} {:>9} {:>6} {:>8} {:>7} {:>7} {:>7} {:>7} {:>5}"
BLADE, SPIRAL = "1,2,3,4", {"spiral": True}
# Part, faces, options; those of the first line aren't timed.
CASES = (
    ("sphere", "1", {}),
    ("sphere", "1", {}),
    ("sphere", "1", {"flow_along": "v"}),
    ("torus", "1", {}),
    ("torus", "1", {"flow_along": "v"}),
    ("cylinder", "1", {}),
    ("ruled", "1", {}),
    ("slanted", "1", {}),
    ("blade", BLADE, {}),
    ("blade", BLADE, SPIRAL),
    ("blade", BLADE, {"flow_along": "v"}),
    ("propeller", "12", {}),
    ("propeller", "3", {}),
    ("propeller", None, {}),
)


def measure(part: Path, faces: str | None, options: dict[str, object]) -> str:
    """Plan, measure, and write the row."""
    mesh = load_mesh(part)
    exact = mesh.model
    assert exact is not None
    chosen = range(len(exact.faces)) if faces is None else [int(number) - 1 for number in faces.split(",")]
    begun = time.perf_counter()
    plan = plan_passes(mesh, fx.Tool.ball(6), PlanOptions(strategy="flow", faces=faces, **options))
    seconds, path = time.perf_counter() - begun, plan.toolpath
    contact, normal = path.contact[path.cutting], path.normal[path.cutting]
    foot = exact.nearest(contact)
    turned = np.degrees(angle_between(foot.normal, normal))
    for face in chosen:
        rows = np.flatnonzero(turned > ROUNDING)
        if len(rows):
            other = exact.nearest(contact[rows], np.full(len(rows), face))
            meets = other.distance < MEETING
            angles = np.degrees(angle_between(other.normal, normal[rows]))
            turned[rows[meets]] = np.minimum(turned[rows], angles)[meets]
    told = path_quality(path, mesh, PlanOptions(strategy="flow", faces=faces)).scallop_largest
    left = left_over(path, exact, chosen, 20_000)
    out = sum(found.value for found in path.findings if found.code == "contacts-left-out")
    how = "spiral" if "spiral" in options else str(options.get("flow_along", "auto"))
    return ROW.format(
        part.stem[:9],
        str(faces or "all"),
        how[:5],
        len(plan.first),
        len(contact),
        f"{seconds:.1f}",
        f"{1000.0 * foot.distance.max():.1e}",
        f"{turned.max():.0e}",
        f"{told:.4f}",
        f"{np.percentile(left, 99.0):.4f}",
        f"{left.max():.4f}",
        f"{out:.0f}",
    )


def write_program(part: Path, folder: Path) -> int:
    """Take a blade from its model to a verified program by one command."""
    options = f"--strategy flow --faces {BLADE} --tool ball:6 --scallop 0.01 --tilt 15:75 --feed 600"
    line = f"optimise {part} -m hayashi-640123 {options} --effort quick -o {folder / 'blade'}"
    print(f"fiveaxis {line}", flush=True)
    begun = time.perf_counter()
    code = subprocess.run([sys.executable, "-m", "fiveaxis.cli", *line.split()], check=False).returncode
    print(f"exit code {code} after {time.perf_counter() - begun:.0f} s")
    return code


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scallop", type=float, default=0.01, help="mm")
    parser.add_argument("--spacing", type=float, default=0.5, help="mm, of contacts")
    parser.add_argument("--quick", action="store_true", help="no propeller")
    parser.add_argument("--program", action="store_true", help="a blade to its program too")
    given = parser.parse_args()
    heads = (
        "part",
        "faces",
        "along",
        "passes",
        "contacts",
        "s",
        "off um",
        "turned",
        "told",
        "99 %",
        "left",
        "out",
    )
    print(ROW.format(*heads))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        subprocess.run([sys.executable, str(MAKER), str(folder)], check=True, capture_output=True)
        for k, (name, faces, options) in enumerate(CASES):
            part = PROPELLER if name == "propeller" else folder / f"{name}.step"
            if part.exists() and not (given.quick and name == "propeller"):
                row = measure(part, faces, options | {"scallop": given.scallop, "spacing": given.spacing})
                if k:
                    print(row, flush=True)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"memory at most {peak:.0f} MB")
        return write_program(folder / "blade.step", folder) if given.program else 0


if __name__ == "__main__":
    sys.exit(main())
