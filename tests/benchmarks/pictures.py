"""Take the pictures of README and documentation from the current code, in a real browser.

Usage: python tests/benchmarks/pictures.py [FOLDER] [--only stock|freecad|app]

Runs `job.toml` and `complete.toml` of `examples/overhang` on the command line, and writes terminal.png,
report.png, simulation.png and postures.png of the first, terminal-green.png and report-green.png of the other
(by default into docs/pages/pictures); program-better.png, program-trade.png and program-stays.png of programs
that are revised in their own lines; stock.png of the first with a stock and narrower passes, half cut, which
is all that `--only stock` makes; and freecad.svg, of what FreeCAD's command gives back with the dress-up of
`examples/freecad`, which `--only freecad` makes without a browser; app.png, the way of a program of five
operations through the page of `fiveaxis app`, and its refusal and a narrow window beside it (app-refusal.png,
app-phone.png), which are all that `--only app` makes.
"""

import argparse
import subprocess
import sys
import tempfile
from html import escape
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imsave

from fiveaxis import load_machine

HERE = Path(__file__).parents[2]
sys.path[:0] = [str(HERE / "tests"), str(HERE / "docs")]
from figures import GREY, ORANGE, STYLE  # noqa: E402
from support.browser import Browser  # noqa: E402
from support.freecad import in_freecad  # noqa: E402
from support.served_page import SIZE, ServedPage, Visitor  # noqa: E402
from support.shop_programs import SHOPS, Row, wall  # noqa: E402

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
# The job's part in 1.5 mm of stock, of which passes 0.7 mm apart leave less than 0.05 mm.
STOCK = ("--part", "examples/overhang/part.stl", "--stock", "part+1.5", "--stepdown", "0.7")
# The part without machine, links and marks, nearer, half cut.
HALF_CUT = (
    "pick('input[value=part]').click();"
    " for (const box of pickAll('[data-node]'))"
    " if (box.checked !== ['workpiece/stock', 'tool'].includes(box.dataset.node)) box.click();"
    " pick('#map').scrollIntoView({block: 'center'});"
    " viewer.camera.zoom = 2.2; viewer.camera.updateProjectionMatrix();"
    " show.seek(0.5 * show.result.duration)"
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
    parser = argparse.ArgumentParser(description="Take the pictures of README and documentation.")
    parser.add_argument("folder", nargs="?", type=Path, default=HERE / "docs" / "pages" / "pictures")
    parser.add_argument("--only", choices=["stock", "freecad", "app"])
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        if asked.only in (None, "freecad"):
            draw_dressup(Path(made), asked.folder / "freecad.svg")
        if asked.only == "freecad":
            return
        browser = Browser(Path(made) / "profile")
        try:
            if asked.only is None:
                take_example(browser, Path(made), asked.folder)
                take_programs(browser, Path(made), asked.folder)
            if asked.only in (None, "app"):
                take_app(browser, Path(made), asked.folder)
            if asked.only != "app":
                said_by("examples/overhang/job.toml", Path(made) / "stock", *STOCK)
                browser.open((Path(made) / "stock" / "preview.html").as_uri(), SIMULATION)
                browser.run(HALF_CUT)
                browser.shoot(asked.folder / "stock.png")
        finally:
            browser.close()
    for picture in sorted(asked.folder.glob("*.png")):
        print(f"{picture}: {picture.stat().st_size / 1000:.0f} kB")


def take_example(browser: Browser, made: Path, folder: Path) -> None:
    """Take the pictures of both jobs."""
    for name, suffix in (("job", ""), ("complete", "-green")):
        page = made / f"{name}.html"
        page.write_text(said_by(f"examples/overhang/{name}.toml", made / name), encoding="utf-8")
        browser.open(page.as_uri())
        browser.shoot(folder / f"terminal{suffix}.png")
        browser.open((made / name / "report.html").as_uri())
        browser.shoot(folder / f"report{suffix}.png")
    browser.open((made / "job" / "preview.html").as_uri(), SIMULATION)
    browser.run(f"{BESIDE}(pick('#beside')); {SEEK}")
    browser.shoot(folder / "simulation.png")
    browser.open((made / "job" / "report.html").as_uri())
    browser.run(TO_MAP)
    browser.shoot(folder / "postures.png")


def take_app(browser: Browser, made: Path, folder: Path) -> None:
    """Take the pictures of the page: the way of a program in four, a refusal, and a narrow window."""
    shop = SHOPS["fanuc"]
    notes = ("(T3 D=6. CR=3. - BALL END MILL)", "(T5 D=8. CR=4. - BALL END MILL)")
    cuts = [*shop.cuts(3, wall(30.0), 1500.0), *shop.cuts(4, wall(24.0)[:1] * 2, 800.0)]
    lines = [*shop.begin, *notes, *shop.face, *shop.drill, *cuts, *shop.cuts(5, wall(24.0), 1200.0)]
    program, binary = made / "bracket.nc", made / "bracket"
    program.write_text("\n".join([*lines, *shop.end]) + "\n", encoding="utf-8")
    binary.write_bytes(b"\x7fELF" + bytes(60))
    page = ServedPage()
    try:
        visitor = Visitor(browser, page)
        visitor.drop(program)
        visitor.wait("document.querySelector('#dropped').textContent === 'bracket.nc'")
        visitor.click("[data-machine=dmu50ev]")
        steps = [visitor.picture(made / "choose.png")]
        visitor.click("#look")
        visitor.wait_for("#watch")
        steps.append(visitor.picture(made / "seen.png"))
        imsave(folder / "app-phone.png", visitor.picture(made / "phone.png", 390)[:1400])
        browser.run("document.querySelector('#effort').value = 'quick'")
        visitor.click("#go")
        visitor.wait("document.querySelector('#bar').value > 0.3")
        steps.append(visitor.picture(made / "busy.png"))
        visitor.wait_for("#result")
        steps.append(visitor.picture(made / "result.png"))
        visitor.click("#change")
        visitor.drop(binary)
        visitor.wait("document.querySelector('#dropped').textContent === 'bracket'")
        visitor.click("#look")
        visitor.wait("document.querySelector('.fault')")
        visitor.picture(folder / "app-refusal.png")
    finally:
        page.close()
    a, b, c, d = (halved(step[: SIZE[1]]) for step in steps)
    rows = [np.concatenate(pair, axis=1) for pair in ((a, b), (c, d))]
    imsave(folder / "app.png", np.concatenate(rows))


def halved(picture: np.ndarray) -> np.ndarray:
    """Make a picture, (h, w, 3), half as large."""
    h, w, _ = picture.shape
    return picture[: h - h % 2, : w - w % 2].reshape(h // 2, 2, w // 2, 2, 3).mean(axis=(1, 3))


def take_programs(browser: Browser, made: Path, folder: Path) -> None:
    """Take the pictures of answers on a program that gets better, is traded, and stays."""
    turn = np.linspace(0.0, 360.0, 73)
    x, y = 30.0 * np.cos(np.radians(turn)), 30.0 * np.sin(np.radians(turn))
    ring = [(float(a), float(b), 2.0, 30.0, float(c)) for a, b, c in zip(x, y, turn, strict=True)]
    trade = ("--allow", "slower,rougher")
    for name, rows, more in (
        ("better", wall(30.0, 9), ()),
        ("trade", wall(30.0, 9), trade),
        ("stays", ring, ()),
    ):
        page = made / f"program-{name}.html"
        page.write_text(said_of(rows, made, *more), encoding="utf-8")
        browser.open(page.as_uri())
        browser.shoot(folder / f"program-{name}.png")


def draw_dressup(made: Path, file: Path) -> None:
    """Draw the path of an operation in FreeCAD, and that of its dress-up."""
    script = "obj = dressup.make(base, given['options'], given['program'])\nanswer([plain(base), plain(obj)])"
    given, better = (in_words(commands) for commands in in_freecad(made, script))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 2.6), layout="constrained")
        sides = figure.subplots(1, 3)
        for axes, rows, name, colour in (
            (sides[0], given, "base", GREY),
            (sides[1], better, "dress-up", ORANGE),
        ):
            # The control counts both rotary axes of this table against those of the machine.
            _, lean = load_machine("linuxcnc-xyzac-trt").forward(
                rows * np.array([1, 1, 1, *[-np.pi / 180.0] * 2])
            )
            top = rows[:, :3] + 25.0 * lean
            axes.plot([rows[:, 0], top[:, 0]], [rows[:, 2], top[:, 2]], color=colour, lw=0.8)
            axes.plot(rows[:, 0], rows[:, 2], color="black")
            axes.set(title=f"tool axes, {name}", xlabel="X, mm", ylabel="Z, mm", aspect="equal")
            for column, letter in ((3, "A"), (4, "C")):
                sides[2].plot(
                    rows[:, 0], rows[:, column], color=colour, label=name if letter == "C" else None
                )
        sides[2].set(title="A and C", xlabel="X, mm", ylabel="deg")
        sides[2].legend(frameon=False)
        figure.savefig(file, metadata={"Date": None})


def in_words(commands: list[tuple[str, dict[str, float]]]) -> np.ndarray:
    """Return where the axes are at the end of each cut, (n, 5) mm and deg, in words of X Y Z A C."""
    words: dict[str, float] = {}
    rows = []
    for name, given in commands:
        words |= given
        if name == "G1":
            rows.append([words[letter] for letter in "XYZAC"])
    return np.array(rows)


def said_of(rows: list[Row], folder: Path, *more: str) -> str:
    """Revise a program of one operation, and return what the command prints as a page."""
    shop = SHOPS["fanuc"]
    lines = [*shop.begin, "(T3 6MM BALL MILL)", *shop.cuts(3, rows, 1500.0), *shop.end]
    (folder / "part.nc").write_text("\n".join(lines) + "\n", encoding="utf-8")
    words = ["optimise", "part.nc", "-m", "dmu50ev", "--cone", "20", "--effort", "quick", *more]
    command = [sys.executable, "-m", "fiveaxis.cli", *words, "-q"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return TERMINAL.format(command=f"fiveaxis {' '.join(words)}", said=escape(done.stdout))


def said_by(job: str, out: Path, *more: str) -> str:
    """Run a job on the command line and return what it prints on stdout as a page."""
    words = [sys.executable, "-m", "fiveaxis.cli", "optimise", job, *more, "-q", "-o", str(out)]
    done = subprocess.run(words, cwd=HERE, capture_output=True, text=True, check=True)
    return TERMINAL.format(command=f"fiveaxis optimise {job} -o out", said=escape(done.stdout))


if __name__ == "__main__":
    main()
