"""The simulation of a whole program in a real browser: its lines, views, panels, and stops at findings."""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from support.browser import NEEDS_BROWSER, Browser
from support.patience import PATIENCE

import fiveaxis as fx
from fiveaxis.show.viewer.page import render_page

pytestmark = NEEDS_BROWSER
READY = "document.body.dataset.ready === 'yes' || document.querySelector('#fault:not([hidden])') !== null"
HEAD = "(T1 D=8. CR=4. - BALL MILL)\nG21 G90 G17 G94 G54\n"
TURNS = 40
# ms that the page takes to go to a place: the least of many tens, as a computer may be busy.
SPENT = (
    "Math.min(...Array.from({length: 20}, (_, part) => { const began = performance.now();"
    " for (let k = 0; k < 10; k++) show.seek((part + k / 10) / 20 * show.result.duration);"
    " return (performance.now() - began) / 10; }))"
)
# The app's, in which the page is a frame.
POLICY = (
    "default-src 'self' 'unsafe-inline' data: blob:; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:"
)


def ring(number: int, radius: float, lean: float) -> list[str]:
    """A tool that comes from afar and cuts a ring."""
    turn = np.linspace(0.0, 2.0 * np.pi, TURNS)
    cuts = [
        f"X{radius * np.cos(t):.3f} Y{radius * np.sin(t):.3f} A{-lean:.3f} C{np.degrees(t):.3f}"
        for t in turn[1:]
    ]
    begin = [f"T{number} M6", "S9000 M3", f"G0 A{-lean:.3f} C0", f"G43.4 H{number}", "G0 X200 Y0", "G0 Z100"]
    return [*begin, f"G1 X{radius} Y0 Z5 F2000", *cuts, "G49", "G0 Z100"]


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    program = tmp_path_factory.mktemp("program") / "part <b>.nc"
    lines = [*ring(1, 30.0, 20.0), *ring(2, 20.0, 30.0)]
    # A turn beyond the limit of 50 deg, twice.
    at = lines.index("T2 M6") + 20
    lines[at:at] = ["A60.", "A-30."]
    lines[at + 10 : at + 10] = ["A60.", "A-30."]
    program.write_text(HEAD + "\n".join(lines) + "\nM30\n")
    machine = fx.load_machine("linuxcnc-xyzac-trt").with_tool_length(100.0)
    return fx.show_program(program, machine, zero=dict.fromkeys("XYAC", 0) | {"Z": -100})


@pytest.fixture(scope="module")
def page(shown, tmp_path_factory):
    return fx.write_preview(shown, tmp_path_factory.mktemp("page") / "page.html")


@pytest.fixture(params=[1280, 900])
def opened(request, browser: Browser, page):
    browser.look(request.param, 800)
    browser.open(page.as_uri(), READY)
    browser.run("show.play(false)")
    yield browser
    browser.ask("Emulation.clearDeviceMetricsOverride")


def press(browser: Browser, key: str) -> None:
    for kind in ("keyDown", "keyUp"):
        browser.ask("Input.dispatchKeyEvent", type=kind, key=key)


def line(browser: Browser) -> int:
    """The line that is marked, which has to be in sight."""
    box = "((f, l) => l && l.top >= f.top && l.bottom <= f.bottom)"
    rect = "(s => (e => e && e.getBoundingClientRect())(pick(s)))"
    assert browser.run(f"{box}({rect}('#lines'), {rect}('.line[aria-current]'))"), "not in sight"
    return browser.run("Number(pick('.line[aria-current]').dataset.line)")


def test_it_opens_on_cuts_and_tool_and_panels_are_beside_the_scene(opened, shown):
    assert opened.complaints == []
    places = opened.run(
        "(({points, cutting}, m) => Array.from(cutting, (cut, r) => cut &&"
        " new THREE.Vector3(...points.subarray(3 * r, 3 * r + 3)).applyMatrix4(m).project(viewer.camera)"
        ".toArray().slice(0, 2)).filter(at => at))(show.result, show.stage.workpiece.matrixWorld)"
    )
    seen = np.array(places)
    assert np.abs(seen).max() < 1.0, "outside the window"
    assert np.ptp(seen, axis=0).max() > 0.25, "too small"
    middle = "(b => document.elementFromPoint(b.left + b.width / 2, b.top + b.height / 2))"
    pane = "pick('#meshcat-pane').getBoundingClientRect()"
    assert opened.run(f"{middle}({pane}).tagName") == "CANVAS"
    width, high = opened.run(f"(b => [b.width, b.height])({pane})")
    assert width > 0.5 * opened.run("innerWidth")
    assert high > 0.5 * 800
    assert opened.run(
        "[viewer.renderer.domElement.clientWidth, viewer.renderer.domElement.clientHeight]"
    ) == [
        round(width),
        round(high),
    ]
    # Closed panels leave all of the width.
    for panel in ("legend", "readings", "program"):
        if opened.run(f"!pick('#{panel}').hidden"):
            opened.run(f"pick('[data-panel={panel}]').click()")
    assert opened.run(f"{pane}.width") == opened.run("innerWidth")
    opened.run("pick('[data-panel=program]').click()")
    assert line(opened) > 0


def test_lines_run_along_and_a_click_on_one_goes_there(opened, shown):
    clock, of = shown.side.clock, shown.side.line
    for share in (0.2, 0.9, 0.5):
        opened.run(f"show.seek({share} * show.result.duration)")
        row = int(np.searchsorted(clock - clock[0], share * (clock[-1] - clock[0])))
        assert line(opened) == of[row]
    wanted = int(of[np.searchsorted(clock, 0.5 * clock[-1])]) + 3
    opened.run(f"pick('.line[data-line=\"{wanted}\"]').click()")
    assert line(opened) == wanted
    assert of[round(opened.run("show.stage.row"))] == wanted
    assert opened.run("pick('.line[aria-current]').textContent") == shown.lines[wanted - 1]
    press(opened, "ArrowDown")
    assert line(opened) == wanted + 1
    press(opened, "ArrowUp")
    press(opened, "ArrowUp")
    assert line(opened) == wanted - 1
    # A line that moves nothing leads to the next that does.
    opened.run("show.lines.frame.scrollTop = 0; show.lines.draw(); pick('.line[data-line=\"4\"]').click()")
    assert line(opened) == of.min()


def test_views_are_chosen_by_keys_and_buttons(opened):
    place = "viewer.camera.position.clone().normalize().toArray()"
    for key, name, wanted in (("1", "front", [0, 0, 1]), ("2", "top", [0, 1, 0]), ("3", "right", [1, 0, 0])):
        press(opened, key)
        np.testing.assert_allclose(opened.run(place), wanted, atol=1e-3)
        opened.run("viewer.camera.position.set(3, 1, 0)")
        opened.run(f"pick('[data-view={name}]').click()")
        np.testing.assert_allclose(opened.run(place), wanted, atol=1e-3)
    away = opened.run("viewer.camera.position.length()")
    opened.run("viewer.camera.position.set(0.5, 0.5, 0.7); viewer.controls.target.set(0.2, 0, 0)")
    press(opened, "f")
    assert opened.run("viewer.camera.position.length()") == pytest.approx(away, rel=1e-3)
    assert opened.run("viewer.controls.target.length()") == 0
    press(opened, "0")
    np.testing.assert_allclose(opened.run(place), np.array([1.75, 1.05, 1.75]) / 2.69, atol=0.01)


def test_it_runs_to_the_first_error_and_stops_and_findings_are_stepped_through(opened, shown):
    clock = shown.side.clock - shown.side.clock[0]
    errors = [f for f in shown.findings if f.severity == "error"]
    beyond = [n for n, text in enumerate(shown.lines, start=1) if text == "A60."]
    rows = [min(shown.side.row_of(f) for f in errors if f.place.line == number) for number in beyond]
    hit = min(shown.side.row_of(f) for f in errors)
    assert hit < rows[0]
    opened.run("show.seek(0); show.speed = 1000")
    for row, said in ((hit, "the machine body"), (rows[0], "A = -50."), (rows[1], "A = -50.")):
        opened.run("pick('#play').click()")
        end = time.monotonic() + PATIENCE
        while opened.run("show.playing"):
            assert time.monotonic() < end, "it never stops"
        assert opened.run("show.time") == pytest.approx(clock[row], abs=1e-6)
        assert line(opened) == shown.side.line[row]
        assert opened.run("pick('#found').textContent").startswith(f"error: {said}")
    found = []
    opened.run("show.seek(0)")
    for _ in range(20):
        press(opened, "n")
        found.append(opened.run("show.time"))
    places = sorted(set(found))
    assert {clock[row] for row in rows} <= {clock[np.abs(clock - place).argmin()] for place in places}
    opened.run("pick('#previous').click()")
    assert opened.run("show.time") < places[-1]
    opened.run("pick('#stop-at').value = '-1'; show.seek(0); show.play(true)")
    end = time.monotonic() + PATIENCE
    while opened.run("show.playing"):
        assert time.monotonic() < end, "it never ends"
    assert opened.run("show.time") == pytest.approx(clock[-1])


def test_a_phones_window_has_the_scene_and_one_panel_at_a_time(browser, page):
    browser.look(390, 800)
    try:
        browser.open(page.as_uri(), READY)
        assert browser.run("document.documentElement.scrollWidth") <= 390
        for panel in ("legend", "readings", "program"):
            browser.run(f"pick('[data-panel={panel}]').click()")
            open_ones = "['legend', 'readings', 'program'].filter(p => !pick('#' + p).hidden)"
            assert browser.run(open_ones) == [panel]
            assert browser.run("pick('#meshcat-pane').clientHeight") > 200
            assert browser.run(f"pick('#{panel}').getBoundingClientRect().bottom") <= 800
    finally:
        browser.ask("Emulation.clearDeviceMetricsOverride")


def test_a_hundred_thousand_lines_are_few_elements(browser, tmp_path):
    turn = np.linspace(0.0, 20.0 * np.pi, 1000)
    path, between = tmp_path / "long.nc", "(a line that moves nothing)\n" * 99
    cuts = "".join(f"{between}X{30.0 * np.cos(t):.3f} Y{30.0 * np.sin(t):.3f}\n" for t in turn)
    path.write_text(f"{HEAD}T1 M6\nG0 A0 C0\nG0 X30 Y1\nG0 Z5\nG1 Z0 F3000\n{cuts}M30\n")
    long = fx.show_program(path, fx.load_machine("linuxcnc-xyzac-trt"))
    browser.open(fx.write_preview(long, tmp_path / "page.html").as_uri(), READY)
    browser.run("show.seek(0.7 * show.result.duration)")
    assert line(browser) == pytest.approx(70_000, rel=0.05)
    assert browser.run("pick('#roll').children.length") < 100
    browser.run("show.lines.frame.scrollTop = 20 * 50000; show.lines.draw()")
    browser.run("pick('.line[data-line=\"50007\"]').click()")
    assert line(browser) == 50_007
    assert browser.run(SPENT) < 50.0, "ms a place"


def test_it_runs_in_a_frame_that_may_only_run_scripts(browser, shown):
    pages = {"/": b"<iframe sandbox='allow-scripts' src='/shown' style='width:900px;height:600px'></iframe>"}
    pages["/shown"] = render_page(shown).encode()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200 if self.path in pages else 404)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Security-Policy", POLICY)
            self.end_headers()
            asked.append(self.path)
            self.wfile.write(pages.get(self.path, b""))

        def log_message(self, *_: object) -> None:
            pass

    asked: list[str] = []
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    outer = browser.session
    try:
        browser.open(f"http://127.0.0.1:{server.server_port}/")
        frames = [t for t in browser.ask("Target.getTargets")["targetInfos"] if t["type"] == "iframe"]
        browser.session = browser.ask("Target.attachToTarget", targetId=frames[0]["targetId"], flatten=True)[
            "sessionId"
        ]
        end = time.monotonic() + PATIENCE
        while not browser.run(f"document.body !== null && ({READY})"):
            assert time.monotonic() < end, browser.complaints
            time.sleep(0.05)
        assert browser.run("pick('#fault').hidden") is True
        assert browser.run("origin") == "null"
        assert asked[:2] == ["/", "/shown"]
        assert set(asked) <= {"/", "/shown", "/favicon.ico"}
    finally:
        browser.session = outer
        server.shutdown()
        server.server_close()
