"""Time the simulation's page in Debian's chromium: made, opened and played, without a stock and with one.

Usage: python tests/benchmarks/viewing.py

The rate of pictures of the long page beside that of the short one shows what its moves cost; the picture
itself is drawn by the processor here, and by the graphics card elsewhere.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh

import fiveaxis as fx
from fiveaxis.base import Workpiece
from fiveaxis.check import Surroundings
from fiveaxis.model import Constraints, follow, motion_energy, rotary_angles
from fiveaxis.posture.solution import Baseline, Optimum
from fiveaxis.show import write_preview

sys.path.insert(0, str(Path(__file__).parents[1]))
from support.browser import Browser

COUNTS = (2_000, 100_000)
PLAY = (
    "new Promise(done => { let n = 0; const began = performance.now(); show.play(true);"
    " (function next() { n++; const spent = performance.now() - began;"
    " if (spent > 4000) done(1000 * n / spent); else requestAnimationFrame(next); })(); })"
)


# ms a step of the stock, to and fro.
STEP = (
    "(() => { const began = performance.now(), to = k => show.stock.show(show.result.duration * k / 1000);"
    " for (let k = 0; k <= 1000; k++) to(k); for (let k = 1000; k >= 0; k--) to(k);"
    " return (performance.now() - began) / 2002; })()"
)


def dome(machine: fx.Machine, count: int, turns: int = 200) -> Optimum:
    """A spiral down a dome of 80 mm with two postures."""
    down, turn = np.linspace(0.3, 1.4, count), np.linspace(0.0, 2.0 * turns * np.pi, count)
    normal = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)], axis=1)
    path = fx.Toolpath.from_contacts(80.0 * normal, normal, fx.Tool.ball(10.0), name="dome")
    found = {}
    for name, lean in (("result", 0.4), ("normal", 0.7)):
        axis = np.cos(lean) * normal + np.sin(lean) * np.stack(
            [-np.sin(turn), np.cos(turn), 0.0 * turn], axis=1
        )
        motion = follow(path, machine, np.unwrap(rotary_angles(machine, axis)[0], axis=0))
        found[name] = Baseline(motion, motion_energy(machine, motion))
    result = found.pop("result")
    tilt = Constraints.of_degrees(tilt=(15.0, 75.0)).lean_bounds(path)
    return Optimum(machine, path, tilt, result.motion, result.energy, found, missing={}, stages=())


def dome_with_stock(machine: fx.Machine, count: int) -> tuple[Optimum, Surroundings]:
    """The dome, with half a millimetre around it at rays 0.27 mm apart."""
    part = trimesh.creation.icosphere(subdivisions=5, radius=80.0)
    return dome(machine, count, count // 100), Surroundings.of(Workpiece(part=part, stock="part+0.5"))


def main() -> None:
    """Make the pages, and look at them."""
    machine = fx.load_machine("hayashi-640123")
    with tempfile.TemporaryDirectory() as made:
        browser = Browser(Path(made) / "profile")
        try:
            cases = [(count, dome(machine, count), None) for count in COUNTS]
            cases += [(count, *dome_with_stock(machine, count)) for count in COUNTS]
            for count, solution, around in cases:
                began = time.process_time()
                page = write_preview(solution, Path(made) / "page.html", surroundings=around)
                spent = time.process_time() - began
                browser.open(page.as_uri(), "document.body.dataset.ready === 'yes'")
                ready = browser.run("performance.getEntriesByName('ready')[0].startTime") / 1000.0
                shown = browser.run(PLAY)
                step = "" if around is None else f", {browser.run(STEP):.2f} ms a step of the stock"
                name = f"{count} moves" + ", with a stock" * (around is not None)
                print(
                    f"{name}: {page.stat().st_size / 1e6:.1f} MB in {spent:.2f} s of processor; first "
                    f"picture after {ready:.2f} s, {shown:.1f} pictures/s{step}"
                )
        finally:
            browser.close()


if __name__ == "__main__":
    main()
