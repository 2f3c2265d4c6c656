"""The page in a real browser: Debian's chromium, headless, driven over its pipe."""

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fiveaxis.collision import Fixture, Surroundings
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.machine import Body, Box, Cylinder
from fiveaxis.toolpath.tool import Holder, Section
from fiveaxis.viewer import preview, write_preview

CHROMIUM = shutil.which("chromium")
PATIENCE = 60.0  # s, for an answer of the browser
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium on the path"),
]
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=1200,800",
    "--remote-debugging-pipe",
]
# The browser's ends of the pipe are its descriptors 3 and 4.
START = 'in=$1 out=$2; shift 2; exec "$@" 3<&"$in" 4>&"$out"'


class Browser:
    """One page in a browser; talks DevTools' protocol: JSON texts, each ended by a zero byte."""

    def __init__(self, profile: Path) -> None:
        theirs_in, self.to = os.pipe()
        self.back, theirs_out = os.pipe()
        command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self.process = subprocess.Popen(
            ["bash", "-c", START, "bash", str(theirs_in), str(theirs_out), *command],
            pass_fds=(theirs_in, theirs_out),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self.number, self.rest, self.session = 0, b"", None
        self.complaints: list[str] = []
        attached = self.ask("Target.attachToTarget", targetId=self._first_page(), flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")

    def _first_page(self) -> str:
        """Give the id of the page that the browser opens, once it has: it answers before."""
        end = time.monotonic() + PATIENCE
        while True:
            pages = [t for t in self.ask("Target.getTargets")["targetInfos"] if t["type"] == "page"]
            if pages:
                return pages[0]["targetId"]
            assert time.monotonic() < end, "the browser opens no page"
            time.sleep(0.05)

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command, and give its answer."""
        self.number += 1
        command: dict[str, Any] = {"id": self.number, "method": method, "params": parameters}
        if self.session is not None:
            command["sessionId"] = self.session
        os.write(self.to, json.dumps(command).encode() + b"\0")
        while True:
            message = self._receive()
            if message.get("id") == self.number:
                assert "error" not in message, message
                return message["result"]
            self._listen(message)

    def _receive(self) -> dict[str, Any]:
        end = time.monotonic() + PATIENCE
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.back], [], [], max(0.0, end - time.monotonic()))
            assert ready, "the browser doesn't answer"
            found = os.read(self.back, 1 << 20)
            assert found, "the browser is gone"
            self.rest += found
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def _listen(self, message: dict[str, Any]) -> None:
        """Keep what the console says of warnings and errors, and every exception."""
        kind, params = message.get("method"), message.get("params", {})
        if kind == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(params["exceptionDetails"])[:500])
        elif kind == "Runtime.consoleAPICalled" and params["type"] in {"error", "warning", "assert"}:
            self.complaints.append(json.dumps(params["args"])[:500])
        elif kind == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.complaints.append(params["entry"]["text"])

    def open(self, url: str) -> None:
        """Load a preview and wait until its scene is there."""
        self.complaints.clear()
        self.ask("Page.navigate", url=url)
        end = time.monotonic() + PATIENCE
        while not self.run(
            "document.body !== null && (document.body.dataset.ready === 'yes'"
            " || document.querySelector('#fault:not([hidden])') !== null)"
        ):
            assert time.monotonic() < end, f"the scene isn't ready: {self.complaints}"
            time.sleep(0.05)

    def run(self, script: str) -> Any:
        """Give the value of an expression in the page."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def shoot(self, path: Path) -> np.ndarray:
        """Take a picture, (h, w, 3) from 0 to 1, and keep it in a file."""
        from matplotlib.image import imread

        # Two frames later the request is drawn.
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))
        return imread(path)[:, :, :3]

    def close(self) -> None:
        self.session = None
        self.ask("Browser.close")
        self.process.wait(PATIENCE)
        os.close(self.to)
        os.close(self.back)


@pytest.fixture(scope="module")
def browser(tmp_path_factory) -> Iterator[Browser]:
    opened = Browser(tmp_path_factory.mktemp("profile"))
    try:
        yield opened
    finally:
        try:
            opened.close()
        finally:
            opened.process.kill()


BODIES = (
    Body("C", Cylinder(80.0, 20.0, (0.0, 0.0, -60.0))),
    Body("bed", Box((300.0, 250.0, 50.0), (0.0, 100.0, -200.0))),
    Body("Z", Box((60.0, 80.0, 100.0), (0.0, 0.0, 200.0))),
)
FINDINGS = (
    Finding(
        Severity.ERROR, "axis-limit", "A <b>bold</b> = -131 deg is below -120 deg", Place(60, 61, "<i>.nc")
    ),
    Finding(Severity.WARNING, "feed-over", "too quick", Place(location=180)),
    Finding(Severity.NOTE, "no-engagement", "nothing is known of the whole path"),
)


@pytest.fixture(scope="module")
def shown(solution):
    """A solution on a machine with bodies, with a tool that is held."""
    holder = Holder(40.0, (Section(12.0, 24.0), Section(20.0, 40.0)))
    tool = replace(solution.toolpath.tool, shank_diameter=8.0, holder=holder)
    machine = replace(solution.machine, bodies=BODIES)
    return replace(solution, machine=machine, toolpath=replace(solution.toolpath, tool=tool))


@pytest.fixture(scope="module")
def around(part):
    clamp = Fixture("<script>alert(1)</script>", Box((20.0, 20.0, 20.0), (60.0, 0.0, -20.0)))
    return Surroundings(part=part, fixtures=(clamp, Fixture("post", Cylinder(5.0, 40.0, (0.0, 60.0, -10.0)))))


@pytest.fixture(scope="module")
def opened(browser, shown, around, tmp_path_factory):
    page = tmp_path_factory.mktemp("page") / "page.html"
    browser.open(write_preview(shown, page, surroundings=around, findings=FINDINGS).as_uri())
    return browser


OBJECT = "viewer.scene_tree.find(parts('/meshcat/fiveaxis/%s')).object"


def pose(browser: Browser, node: str) -> list[float]:
    """Where a node of the scene is, beside the one above it, and how it is turned."""
    found = f"(o => [...o.position.toArray(), ...o.quaternion.toArray()])({OBJECT % node})"
    return browser.run(found)


def seen(browser: Browser, node: str) -> bool:
    """Whether a node and all above it are to be seen."""
    return browser.run(f"(o => {{ while (o && o.visible) o = o.parent; return !o; }})({OBJECT % node})")


def middle(browser: Browser, node: str) -> np.ndarray:
    """Where a node is in the view."""
    found = f"(o => {{ o.updateWorldMatrix(true, false); return o.matrixWorld.toArray(); }})({OBJECT % node})"
    return np.array(browser.run(found)[12:15])


def seek(browser: Browser, time: float) -> None:
    moved = f"s.value = {time}; s.dispatchEvent(new Event('input'));"
    browser.run(f"(s => {{ {moved} }})(pick('#time'))")


def choose(browser: Browser, view: str) -> None:
    browser.run(f"pick('input[value={view}]').click()")


def test_the_page_loads_without_an_error(opened):
    assert opened.run("document.body.dataset.ready") == "yes"
    assert opened.run("pick('#fault').hidden") is True
    assert opened.complaints == []


def test_part_path_tool_and_fixtures_are_seen_and_the_picture_is_kept(opened, tmp_path):
    for node in (
        "part",
        "after/path",
        "after/tool/cutter",
        "after/tool/holder",
        "fixtures/0",
        "after/marks/error",
    ):
        assert seen(opened, node), node
    assert not seen(opened, "before/path")
    assert not seen(opened, "machine/Z")
    picture = opened.shoot(tmp_path / "result.png")[:, 420:]
    bright = picture.min(axis=2) > 0.3
    saturated = picture.max(axis=2) - picture.min(axis=2) > 0.2
    assert bright.mean() > 0.05, "neither part nor tool"
    assert saturated.sum() > 100, "no coloured path"


def test_the_part_is_what_its_box_shows_and_hides(opened, tmp_path):
    seek(opened, 2.0)
    full = opened.shoot(tmp_path / "with.png")
    opened.run("pick('input[value=part]').click()")
    bare = opened.shoot(tmp_path / "without.png")
    opened.run("pick('input[value=part]').click()")
    assert (np.abs(full - bare).max(axis=2) > 0.05).mean() > 0.05


def test_the_tool_stands_where_the_motion_is_at_that_time(opened, shown, tmp_path):
    from fiveaxis.kinematics import tool_poses

    tip, _ = tool_poses(shown.machine, shown.motion.positions)
    clock = np.cumsum(shown.motion.time)
    pictures = []
    for row in (30, 100):
        seek(opened, clock[row])
        found = pose(opened, "after/tool")
        np.testing.assert_allclose(found[:3], tip[row], atol=1e-3)
        pictures.append(opened.shoot(tmp_path / f"at-{row}.png"))
    assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 0.1).sum() > 1000


def test_play_moves_tool_and_machine_and_pause_holds_them(opened):
    seek(opened, 1.0)
    nodes = ("after/tool", "machine/Z", "machine/bed")
    before = [pose(opened, node) for node in nodes]
    opened.run("pick('#play').click()")
    end = time.monotonic() + PATIENCE
    while opened.run("viewer.animator.time") < 1.2:
        assert time.monotonic() < end, "the clock stands still"
    opened.run("pick('#play').click()")
    after = [pose(opened, node) for node in nodes]
    assert all(np.abs(np.subtract(a, b)).max() > 1e-3 for a, b in zip(before, after, strict=True))
    time.sleep(0.2)
    assert [pose(opened, node) for node in nodes] == after


def test_side_by_side_shows_both_with_parts_of_their_own(opened, tmp_path):
    choose(opened, "apart")
    for node in ("after/tool", "before/tool", "before/path", "part", "before/part", "before/fixtures/1"):
        assert seen(opened, node), node
    assert not seen(opened, "before/machine")
    opened.run("pick('input[value=machine]').click()")
    assert seen(opened, "machine/Z/2")
    assert seen(opened, "before/machine/Z/2")
    opened.run("pick('input[value=machine]').click()")
    middles = [middle(opened, node) for node in ("part", "before/part")]
    assert np.linalg.norm(np.subtract(*middles)) > 1.0
    opened.shoot(tmp_path / "side-by-side.png")
    choose(opened, "after")
    assert not seen(opened, "before/part")


def test_a_finding_takes_the_show_to_its_location(opened, shown):
    opened.run("pick('button.error').click()")
    assert opened.run("viewer.animator.time") == pytest.approx(np.cumsum(shown.motion.time)[60], abs=1e-3)
    assert "location 60" in opened.run("pick('#clock').textContent")


def test_names_from_files_are_text_and_nothing_else(opened):
    legend = opened.run("pick('#legend').textContent")
    for name in ("<ring> & co.csv", "<script>alert(1)</script>", "<b>bold</b>", "<i>.nc:61"):
        assert name in legend
    assert opened.run("document.querySelectorAll('#legend script, #legend b, #legend i').length") == 0


def test_the_live_page_loads_without_an_error(browser, shown, around):
    with preview(shown, surroundings=around, open_browser=False) as live:
        browser.open(live.url())
        assert browser.complaints == []
        assert seen(browser, "part")
