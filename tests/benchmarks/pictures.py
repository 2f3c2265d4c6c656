"""Take the pictures of README and documentation from the current code, in a real browser.

Usage: python tests/benchmarks/pictures.py [FOLDER]

Runs `examples/overhang/job.toml` and writes simulation.png, report.png and postures.png (by default into
docs/pages/pictures).
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from fiveaxis.job import read_job, run_job, write_outcome

HERE = Path(__file__).parents[2]
sys.path.insert(0, str(HERE / "tests"))
from browser import Browser  # noqa: E402

# Where in the program the simulation is shown: a share of its duration.
PLACE = 0.45
BESIDE = (
    "(s => { s.value = [...s.options].find(o => o.text === 'normal').value;"
    " s.dispatchEvent(new Event('change')); })"
)
SEEK = f"show.seek({PLACE} * show.result.duration)"
TO_MAP = (
    "[...document.querySelectorAll('h2')].find(h => h.textContent === 'Choice of posture').scrollIntoView()"
)
SIMULATION = "document.body.dataset.ready === 'yes'"


def main() -> None:
    """Run the example and take the pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "docs" / "pages" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        out = Path(made) / "out"
        write_outcome(run_job(read_job(HERE / "examples" / "overhang" / "job.toml")), out)
        browser = Browser(Path(made) / "profile")
        try:
            browser.open((out / "preview.html").as_uri(), SIMULATION)
            browser.run(f"{BESIDE}(pick('#beside')); {SEEK}")
            browser.shoot(folder / "simulation.png")
            browser.open((out / "report.html").as_uri())
            browser.shoot(folder / "report.png")
            browser.run(TO_MAP)
            browser.shoot(folder / "postures.png")
        finally:
            browser.close()
    for picture in sorted(folder.glob("*.png")):
        print(f"{picture}: {picture.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
