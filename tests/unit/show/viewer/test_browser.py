"""The preview in a real browser."""

import csv
import time
from dataclasses import replace

import numpy as np
import pytest
from support.browser import NEEDS_BROWSER, Browser
from support.patience import PATIENCE

from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import Fixture, Surroundings
from fiveaxis.model import (
    Body,
    Box,
    Cylinder,
    follow,
    interpolate,
    link_poses,
    load_machine,
    rotary_angles,
    tool_poses,
    with_powers,
)
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.nc import write_motion
from fiveaxis.show import preview, write_preview
from fiveaxis.show.viewer.moves import choose_sides, read_off

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


def seek(browser: Browser, time: float) -> None:
    moved = f"s.value = {time}; s.dispatchEvent(new Event('input'));"
    browser.run(f"(s => {{ {moved} }})(pick('#time'))")


def matrix(browser: Browser, thing: str) -> np.ndarray:
    """Where something of a stage is, (4, 4) mm, below its stage."""
    return np.reshape(browser.run(f"{thing}.matrix.toArray()"), (4, 4)).T


def seen(browser: Browser, node: str, stage: str = "show.stage") -> bool:
    """Whether a node of a stage and all above it are to be seen."""
    found = f"child({stage}.group, '{node}')"
    return browser.run(
        f"(o => {{ if (!o) return false; while (o && o.visible) o = o.parent; return !o; }})({found})"
    )


def text(browser: Browser, selector: str) -> str:
    return browser.run(f"pick('{selector}').textContent")


def press(browser: Browser, key: str) -> None:
    for kind in ("keyDown", "keyUp"):
        browser.ask("Input.dispatchKeyEvent", type=kind, key=key, text=" " if key == " " else "")


def test_the_page_loads_without_an_error(opened):
    assert opened.run("document.body.dataset.ready") == "yes"
    assert opened.run("pick('#fault').hidden") is True
    assert opened.complaints == []


def test_part_path_tool_machine_and_fixtures_are_seen(opened, tmp_path):
    seek(opened, 2.0)
    for node in (
        "workpiece/part",
        "workpiece/path",
        "workpiece/fixtures/0",
        "workpiece/marks/error",
        "tool/cutter",
        "tool/holder",
        "links/Z",
    ):
        assert seen(opened, node), node
    assert not seen(opened, "workpiece/path", "show.twin")
    picture = opened.shoot(tmp_path / "result.png")[:480, 420:780]
    bright = picture.min(axis=2) > 0.3
    saturated = picture.max(axis=2) - picture.min(axis=2) > 0.2
    assert bright.mean() > 0.01, "neither part nor tool"
    assert saturated.sum() > 100, "no coloured path"


def test_a_box_shows_and_hides_what_it_names(opened, tmp_path):
    seek(opened, 2.0)
    full = opened.shoot(tmp_path / "with.png")
    opened.run("pick('[data-node=\"workpiece/part\"]').click()")
    bare = opened.shoot(tmp_path / "without.png")
    opened.run("pick('[data-node=\"workpiece/part\"]').click()")
    assert (np.abs(full - bare).max(axis=2) > 0.05).mean() > 0.01


def test_links_and_tool_are_where_the_chain_has_them_at_ten_places(opened, shown):
    clock = np.cumsum(shown.motion.time)
    for row in np.linspace(0, len(clock) - 1, 10).astype(int):
        seek(opened, float(clock[row]))
        positions = shown.motion.positions[row : row + 1]
        tip, axis = tool_poses(shown.machine, positions)
        tool = matrix(opened, "show.stage.tool")
        np.testing.assert_allclose(tool[:3, 3], tip[0], atol=2e-3)
        np.testing.assert_allclose(tool[:3, 2], axis[0], atol=1e-4)
        for link, pose in link_poses(shown.machine, positions).items():
            if link in ("C", "bed", "Z"):
                np.testing.assert_allclose(matrix(opened, f"show.stage.links.{link}"), pose[0], atol=2e-3)


def test_in_the_machines_frame_the_bed_stands_still_and_in_the_parts_the_part(opened, shown):
    clock = np.cumsum(shown.motion.time)
    in_view = "new THREE.Matrix4().multiplyMatrices(show.stage.group.matrix, show.stage.links.bed.matrix)"
    for frame, stands in (("machine", in_view), ("part", "show.stage.group.matrix")):
        opened.run(f"pick('input[value={frame}]').click()")
        found = []
        for row in (30, 150):
            seek(opened, float(clock[row]))
            found.append(np.array(opened.run(f"({stands}).toArray()")))
        np.testing.assert_allclose(found[0], found[1], atol=1e-6)
    press(opened, "m")
    assert opened.run("pick('input[value=machine]').checked") is True


def test_what_is_read_off_is_what_motion_csv_says(opened, shown, tmp_path):
    written = write_motion(shown.motion, tmp_path / "motion.csv", shown.machine)
    rows = list(csv.DictReader(line for line in written.read_text().splitlines() if not line.startswith("#")))
    clock = np.cumsum(shown.motion.time)
    letters = [axis.letter for axis in shown.machine.axes]
    for row in np.linspace(1, len(rows) - 1, 10).astype(int):
        seek(opened, float(clock[row]))
        for number, letter in enumerate(letters):
            said = text(opened, f'tr[data-axis="{number}"] .value').split()[0].rstrip("°").replace(",", "")
            assert float(said) == pytest.approx(float(rows[row][letter]), abs=2e-3)
        assert float(text(opened, "tr[data-figure=location] .value")) == pytest.approx(row, abs=0.05)
        if shown.motion.cutting[row]:
            feed = text(opened, "tr[data-figure=programmed] .value").split()[0].replace(",", "")
            assert float(feed) == pytest.approx(float(rows[row]["feed"]), rel=1e-3)


def test_keys_step_play_and_pause(opened, shown):
    clock = np.cumsum(shown.motion.time)
    seek(opened, float(clock[40]))
    press(opened, "ArrowRight")
    assert opened.run("show.time") == pytest.approx(clock[41], abs=1e-6)
    press(opened, "ArrowLeft")
    press(opened, "ArrowLeft")
    assert opened.run("show.time") == pytest.approx(clock[39], abs=1e-6)
    press(opened, "End")
    assert opened.run("show.time") == pytest.approx(clock[-1])
    press(opened, "Home")
    press(opened, " ")
    end = time.monotonic() + PATIENCE
    while opened.run("show.time") < 0.2:
        assert time.monotonic() < end, "the clock stands still"
    press(opened, " ")
    stopped = opened.run("show.time")
    time.sleep(0.2)
    assert opened.run("show.time") == stopped


def test_a_click_on_the_path_goes_there(opened, shown):
    seek(opened, 1.0)
    row = 140
    place = opened.run(
        f"(p => {{ const v = new THREE.Vector3(...show.result.points.subarray(3 * {row}, 3 * {row} + 3))"
        ".applyMatrix4(show.stage.workpiece.matrixWorld).project(viewer.camera);"
        " const b = pick('#meshcat-pane canvas').getBoundingClientRect();"
        " return [b.left + (v.x + 1) / 2 * b.width, b.top + (1 - v.y) / 2 * b.height]; })()"
    )
    opened.run(f"show.click({place[0]}, {place[1]})")
    found = opened.run("show.stage.row")
    points = read_off(choose_sides(shown)[0], shown.machine)["points"]
    assert np.linalg.norm(points[round(found)] - points[row]) < 3.0


def test_the_time_line_is_dragged(opened):
    box = opened.run("(b => [b.left, b.top, b.width, b.height])(pick('#timeline').getBoundingClientRect())")
    for share, kind in ((0.25, "mousePressed"), (0.75, "mouseMoved"), (0.75, "mouseReleased")):
        opened.ask(
            "Input.dispatchMouseEvent",
            type=kind,
            x=box[0] + share * box[2],
            y=box[1] + 0.5 * box[3],
            button="left",
            buttons=0 if kind == "mouseReleased" else 1,
            clickCount=1,
        )
    assert opened.run("show.time / show.result.duration") == pytest.approx(0.75, abs=0.01)


def test_a_baseline_stands_beside_the_result_at_the_same_location(opened, shown, tmp_path):
    seek(opened, 3.0)
    opened.run("(s => { s.value = '1'; s.dispatchEvent(new Event('change')); })(pick('#beside'))")
    for node in ("workpiece/part", "workpiece/path", "tool/cutter", "links/Z"):
        assert seen(opened, node, "show.twin"), node
    assert text(opened, "#other-name") == "normal"
    place = float(opened.run("show.result.at('place', show.stage.row)"))
    other = interpolate(shown.compared["normal"].motion.positions, np.array([place]))
    tip, _ = tool_poses(shown.machine, other)
    np.testing.assert_allclose(matrix(opened, "show.twin.tool")[:3, 3], tip[0], atol=2e-3)
    opened.shoot(tmp_path / "side-by-side.png")
    opened.run("(s => { s.value = ''; s.dispatchEvent(new Event('change')); })(pick('#beside'))")
    assert not seen(opened, "tool", "show.twin")


def drawn(browser: Browser, half: int) -> dict[str, set[tuple[int, int]]]:
    """Marks of starts and reversals, (axis, pixel across), in a half of the rows below the curves."""
    code = (
        "(c => { const ratio = window.devicePixelRatio, found = {start: [], reversal: []};"
        " for (let a = 0; a < 5; a++) {"
        f" const y = c.height + (12 * (a - 5) + 1 + 6 * {half}) * ratio;"
        " const row = c.getContext('2d').getImageData(0, y, c.width, 1).data;"
        " for (let x = 0; x < c.width; x++) {"
        "  const at = [...row.subarray(4 * x, 4 * x + 3)].join();"
        "  if (at === '79,209,181') found.start.push([a, x]);"
        "  if (at === '255,122,217') found.reversal.push([a, x]); } }"
        " return found; })(pick('#curves'))"
    )
    return {kind: {tuple(mark) for mark in marks} for kind, marks in browser.run(code).items()}


def test_the_time_line_marks_where_each_axis_starts_and_reverses(opened, shown):
    width, duration = opened.run("pick('#curves').width"), shown.motion.time.sum()
    found, counted = drawn(opened, 0), shown.energy.steadiness
    at = np.round(counted.time / duration * (width - 1)).astype(int)
    wanted = {
        name: {(int(c), int(x)) for c, x in zip(counted.column[some], at[some], strict=True)}
        for name, some in (("start", ~counted.reverses), ("reversal", counted.reverses))
    }
    assert wanted["reversal"]
    assert found["reversal"] == wanted["reversal"]
    # A reversal hides a start at the same pixel.
    assert found["start"] == wanted["start"] - wanted["reversal"]
    assert drawn(opened, 1) == found


def test_a_baseline_beside_the_result_has_its_marks_below_the_results(opened, shown):
    alone = drawn(opened, 0)
    opened.run("(s => { s.value = '1'; s.dispatchEvent(new Event('change')); })(pick('#beside'))")
    assert drawn(opened, 0) == alone
    below, counted = drawn(opened, 1), shown.baselines["normal"].steadiness
    axes = {axis for marks in below.values() for axis, _ in marks}
    assert axes == set(counted.column.tolist())
    # At the place of the path where the result is then.
    place = np.interp(counted.time, np.cumsum(shown.compared["normal"].motion.time), np.arange(240))
    time = np.interp(place, np.arange(240), np.cumsum(shown.motion.time))
    at = time / shown.motion.time.sum() * (opened.run("pick('#curves').width") - 1)
    for axis, x in set().union(*below.values()):
        assert np.abs(at[counted.column == axis] - x).min() <= 1.0
    opened.run("(s => { s.value = ''; s.dispatchEvent(new Event('change')); })(pick('#beside'))")
    assert drawn(opened, 1) == alone


def test_a_finding_takes_the_show_to_its_location(opened):
    opened.run("pick('button.error').click()")
    assert opened.run("show.stage.row") == pytest.approx(60.0, abs=1e-6)


def test_a_narrow_window_holds_the_panels(opened):
    opened.ask("Emulation.setDeviceMetricsOverride", width=400, height=800, deviceScaleFactor=1, mobile=False)
    try:
        assert opened.run("document.documentElement.scrollWidth") <= 400
        for panel in ("#legend", "#readings", "#controls"):
            left, right = opened.run(f"(b => [b.left, b.right])(pick('{panel}').getBoundingClientRect())")
            assert left >= 0.0
            assert right <= 400.0
    finally:
        opened.ask("Emulation.clearDeviceMetricsOverride")


# One of each kind: tables, table and head, heads, an axis at 45 deg.
@pytest.mark.parametrize("name", ["linuxcnc-xyzac-trt", "dmu80p-duoblock", "linuxcnc-bridgemill", "dmu50ev"])
def test_a_machine_of_each_kind_moves_as_its_chain(name, browser, solution, tmp_path):
    machine = with_powers(load_machine(name).with_tool_length(100.0))
    rotary = np.unwrap(
        rotary_angles(machine, tool_poses(solution.machine, solution.motion.positions)[1])[0], axis=0
    )
    motion = follow(solution.toolpath, machine, rotary)
    there = replace(solution, machine=machine, motion=motion, compared={})
    browser.open(write_preview(there, tmp_path / "page.html").as_uri(), READY)
    assert browser.complaints == []
    clock = np.cumsum(there.timed().time)
    for row in (0, 100, 239):
        seek(browser, float(clock[row]))
        tip, axis = tool_poses(machine, motion.positions[row : row + 1])
        tool = matrix(browser, "show.stage.tool")
        np.testing.assert_allclose(tool[:3, 3], tip[0], atol=5e-3)
        np.testing.assert_allclose(tool[:3, 2], axis[0], atol=1e-4)


def test_the_live_page_loads_without_an_error(browser, shown, around):
    with preview(shown, surroundings=around, open_browser=False) as live:
        browser.open(live.url(), READY)
        assert browser.complaints == []
        assert seen(browser, "workpiece/part")
