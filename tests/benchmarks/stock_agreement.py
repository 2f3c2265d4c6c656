"""Gouges by the exact check and by the cut stock, side by side, on whole programs with and without a fault.

usage: python tests/benchmarks/stock_agreement.py [--larger 0.1]

Every part is planned for a ball, optimised, and its program verified with a stock of 0.5 mm around it: for
that ball, and for one whose radius is larger by `--larger` mm, so that it cuts into the part. *exact* is the
deepest gouge of the check against the part's mesh, *stock* that of the cut stock, and *rays* its uncertainty,
mm; `!` marks what is an error. They agree where both tell a gouge, or neither does.
"""

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import fiveaxis as fx
from fiveaxis.cam import load_mesh, plan_contour

ROOT = Path(__file__).parents[2]
MESHES = ROOT.parent / "shared/data/meshes"
# Part, tool, how it is planned and tilted.
CASES = {
    "example": (ROOT / "examples/overhang/part.stl", 8.0, {"stepdown": 4.0, "overhang": True}, (15, 75)),
    "example, raster": (
        ROOT / "examples/overhang/part.stl",
        6.0,
        {"strategy": "raster", "stepover": 3.0},
        (10, 60),
    ),
    "supportless": (MESHES / "supportless_sample.stl", 6.0, {"stepdown": 4.0}, (15, 75)),
    "propeller": (MESHES / "propeller_d.stl", 4.0, {"strategy": "raster", "stepover": 5.0}, (15, 75)),
}
ROW = "{:18} {:>9} {:>9} {:>7} {:>9} {:>7} {:>6} {:>9}"


def verdict(file: Path, machine: fx.Machine, part: Path, tool: fx.Tool) -> list[str]:
    """Verify a program's file; both depths, with a mark where they are errors, and the uncertainty."""
    report = fx.verify_program(file, machine, tool=tool, part=part, stock="part+0.5")
    exact, cut = report.figures["gouge_depth_mm"], report.cut
    assert cut is not None
    told = [f.message for f in report.findings if f.code == "gouge" and f.severity == "error"]
    by_stock = any("the finished part lacks" in message for message in told)
    by_mesh = any("the finished part lacks" not in message for message in told)
    return [
        f"{exact:.4f}{'!' * by_mesh}",
        f"{cut.deviations.deepest:.4f}{'!' * by_stock}",
        f"{cut.deviations.uncertainty:.3f}",
        f"{report.figures['left_over_mm']:.3f}",
        "yes" if by_stock == by_mesh else "NO",
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--larger", type=float, default=0.1)
    parser.add_argument("--only", nargs="*", default=list(CASES))
    options = parser.parse_args()
    print(ROW.format("part", "locations", "larger", "exact", "stock", "rays", "left", "agree"))
    machine = fx.load_machine("hayashi-640123")
    for name in options.only:
        part, diameter, planning, tilt = CASES[name]
        if not part.exists():
            print(f"{name}: {part} isn't there")
            continue
        mesh, tool = load_mesh(part), fx.Tool.ball(diameter)
        path = plan_contour(mesh, tool, spacing=2.0, feed_mm_min=1000.0, **planning)
        solution = fx.optimise(path, machine, tilt=tilt, effort="quick")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "program.ngc"
            file.write_text("\n".join(solution.program().text.lines))
            for larger in (0.0, options.larger):
                figures = verdict(file, machine, part, fx.Tool.ball(diameter + 2.0 * larger))
                print(ROW.format(name, len(path), f"{larger:g}", *figures), flush=True)


if __name__ == "__main__":
    main()
