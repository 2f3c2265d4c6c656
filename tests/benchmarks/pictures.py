"""Take the pictures of README and documentation from the current code, in a real browser.

Usage: python tests/benchmarks/pictures.py [FOLDER]

Runs `job.toml` and `complete.toml` of `examples/overhang` on the command line, and writes terminal.png,
report.png, simulation.png and postures.png of the first, terminal-green.png and report-green.png of the other
(by default into docs/pages/pictures).
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from html import escape
from pathlib import Path

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
# What a terminal of 80 columns shows.
TERMINAL = (
    "<meta charset=utf-8><style>body {{ margin: 0; padding: 24px; background: #16181c; color: #e8e8e8 }}"
    " pre {{ font: 19px/1.35 'DejaVu Sans Mono', monospace; width: 80ch }}</style>"
    "<pre>$ {command}\n{said}</pre>"
)


def main() -> None:
    """Run the example and take the pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "docs" / "pages" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        out = Path(made) / "job"
        browser = Browser(Path(made) / "profile")
        try:
            for name, suffix in (("job", ""), ("complete", "-green")):
                page = Path(made) / f"{name}.html"
                page.write_text(
                    said_by(f"examples/overhang/{name}.toml", Path(made) / name), encoding="utf-8"
                )
                browser.open(page.as_uri())
                browser.shoot(folder / f"terminal{suffix}.png")
                browser.open((Path(made) / name / "report.html").as_uri())
                browser.shoot(folder / f"report{suffix}.png")
            browser.open((out / "preview.html").as_uri(), SIMULATION)
            browser.run(f"{BESIDE}(pick('#beside')); {SEEK}")
            browser.shoot(folder / "simulation.png")
            browser.open((out / "report.html").as_uri())
            browser.run(TO_MAP)
            browser.shoot(folder / "postures.png")
        finally:
            browser.close()
    for picture in sorted(folder.glob("*.png")):
        print(f"{picture}: {picture.stat().st_size / 1000:.0f} kB")


def said_by(job: str, out: Path) -> str:
    """Run a job on the command line and return what it prints on stdout as a page."""
    words = [sys.executable, "-m", "fiveaxis.cli", "optimise", job, "-q", "-o", str(out)]
    done = subprocess.run(words, cwd=HERE, capture_output=True, text=True, check=True)
    return TERMINAL.format(command=f"fiveaxis optimise {job} -o out", said=escape(done.stdout))


if __name__ == "__main__":
    main()
