"""The preview in a real browser."""

import time
from dataclasses import replace

import numpy as np
import pytest
from browser import NEEDS_BROWSER, PATIENCE, Browser

from fiveaxis.collision import Fixture, Surroundings
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.machine import Body, Box, Cylinder
from fiveaxis.toolpath.tool import Holder, Section
from fiveaxis.viewer import preview, write_preview

pytestmark = NEEDS_BROWSER
# The scene is there, or the page says why it isn't.
READY = "document.body.dataset.ready === 'yes' || document.querySelector('#fault:not([hidden])') !== null"

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
    browser.open(write_preview(shown, page, surroundings=around, findings=FINDINGS).as_uri(), READY)
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
        browser.open(live.url(), READY)
        assert browser.complaints == []
        assert seen(browser, "part")
