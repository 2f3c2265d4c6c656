"""The report in a real browser: values under the pointer, zoom, keys, narrow screens, the dark, paper."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import NEEDS_BROWSER, Browser

from fiveaxis.base.findings import Gap, risk
from fiveaxis.check import Report
from fiveaxis.posture import Optimum
from fiveaxis.show import ReportDocument, write_report

pytestmark = NEEDS_BROWSER
READY = "document.body.dataset.ready === 'yes'"
CHART = "document.querySelectorAll('svg[data-over=location]')[1]"  # axis values and tilt
NASTY = "</script><b>bold</b>&amp;.csv"
# Colours of text that have to be told from what lies behind, and by how much (WCAG 2.1, AA).
TEXTS = "body, .facts, .headline, .answer h2, dd, td, th, caption, figcaption"
CONTRAST = 4.5


@pytest.fixture(scope="module")
def written(solution: Optimum, tmp_path_factory: pytest.TempPathFactory) -> Path:
    verdict = Report(
        (), {}, {"gouge_depth_mm": None}, ((NASTY, None),), ((risk(NASTY), None), (Gap("a" * 200), None))
    )
    named = replace(solution, toolpath=replace(solution.toolpath, name=NASTY))
    path = tmp_path_factory.mktemp("report") / "report.html"
    return write_report(ReportDocument(named, verdict), path)


@pytest.fixture
def opened(browser: Browser, written: Path) -> Iterator[Browser]:
    browser.look()
    browser.open(written.as_uri(), READY)
    yield browser
    assert browser.complaints == []


def mouse(browser: Browser, kind: str, share: float, **more: Any) -> None:
    """Act at a share of the panels' width, in the middle of the chart's first panel."""
    browser.run(f"{CHART}.scrollIntoView()")
    left, top, width = browser.run(f"(r => [r.left, r.top, r.width])({CHART}.getBoundingClientRect())")
    unit = width / 518.0
    x, y = left + unit * (58.0 + 450.0 * share), top + unit * 50.0
    browser.ask("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **more)


def drag(browser: Browser, begin: float, end: float) -> None:
    mouse(browser, "Moved", begin)
    mouse(browser, "Pressed", begin, button="left", clickCount=1)
    mouse(browser, "Moved", end, button="left", buttons=1)
    mouse(browser, "Released", end, button="left", clickCount=1)


def read(browser: Browser) -> list[list[float]]:
    """Return the values shown: those of each panel, before and after."""
    texts = browser.run(f"[...{CHART}.querySelectorAll('.read')].map(t => t.textContent)")
    return [[float(v.replace("−", "-")) for v in re.findall(r"[−\d][\d.]*", text)] for text in texts]


def ticks(browser: Browser) -> list[float]:
    """Return the numbers below the chart."""
    found = browser.run(f"[...{CHART}.querySelectorAll('.words text')].map(t => t.textContent)")
    return [float(word.replace("\u2009", "").replace("−", "-")) for word in found]


def test_the_value_under_the_pointer_is_that_of_the_motion(opened: Browser, solution: Optimum) -> None:
    machine, n = solution.machine, len(solution.toolpath)
    motions = [solution.compared["normal"].motion, solution.motion]
    shown = np.stack([machine.shown(motion.positions) for motion in motions], axis=2)
    low, high = browser_range(opened)
    for row in np.linspace(3, n - 4, 10).round().astype(int).tolist():
        mouse(opened, "Moved", (row - low) / (high - low))
        values = np.array(read(opened))
        # A chart's panel is 6 600 steps high, and the pointer stands between two locations.
        near = shown[row - 1 : row + 2]
        slack = np.ptp(shown, axis=(0, 2))[:, None] * 1.2 / 3000.0
        assert np.all(values[:5] >= near.min(axis=0) - slack), row
        assert np.all(values[:5] <= near.max(axis=0) + slack), row


def browser_range(browser: Browser) -> list[float]:
    """Return the range of locations of the chart."""
    found = browser.run(f"{CHART}.querySelector('.panel').dataset.x")
    return [float(word) for word in found.split()]


def test_dragging_zooms_all_charts_of_the_path_and_a_double_click_shows_the_whole(opened: Browser) -> None:
    whole = ticks(opened)
    drag(opened, 0.2, 0.3)
    assert 70 <= min(ticks(opened)) <= max(ticks(opened)) <= 110
    across = "[...document.querySelectorAll('svg[data-over=location] .words')].map(w => w.textContent)"
    assert len(set(opened.run(across))) == 1
    for _ in range(2):
        mouse(opened, "Pressed", 0.5, button="left", clickCount=2)
        mouse(opened, "Released", 0.5, button="left", clickCount=2)
    assert ticks(opened) == whole


def test_keys_move_the_pointer_zoom_and_say_the_values(opened: Browser) -> None:
    whole = ticks(opened)
    opened.run(f"{CHART}.focus()")
    opened.press("ArrowRight", 39)
    first = opened.run("[...document.querySelectorAll('output')].map(o => o.textContent).join('')")
    assert re.match(r"location 18\d\.\d\. X \(mm\): normal ", first)
    for _ in range(3):
        opened.press("+")
    assert max(ticks(opened)) - min(ticks(opened)) < 60
    opened.press("Escape", 27)
    assert ticks(opened) == whole


def test_every_chart_can_be_reached_by_keys(opened: Browser) -> None:
    assert opened.run("[...document.querySelectorAll('svg.live')].every(c => c.tabIndex === 0)")
    assert opened.run("document.querySelectorAll('svg.live').length") == 4


@pytest.mark.parametrize("width", [360, 1200])
def test_the_page_is_never_wider_than_the_window(opened: Browser, width: int) -> None:
    opened.look(width, 800)
    wide, window = opened.run("[document.documentElement.scrollWidth, document.documentElement.clientWidth]")
    assert wide <= window
    assert opened.run("document.documentElement.scrollHeight") > 1000


@pytest.mark.parametrize("dark", [False, True])
def test_text_stands_out_in_the_light_and_in_the_dark(opened: Browser, dark: bool) -> None:
    opened.look(dark=dark)
    pairs = opened.run(
        f"""[...document.querySelectorAll({TEXTS!r})].map(e => {{
            let b = e;
            while (b && getComputedStyle(b).backgroundColor === 'rgba(0, 0, 0, 0)') b = b.parentElement;
            return [getComputedStyle(e).color, getComputedStyle(b).backgroundColor];
        }})"""
    )
    assert len(pairs) > 50
    for ink, paper in {tuple(pair) for pair in pairs}:
        light, other = (luminance(ink), luminance(paper))
        assert (max(light, other) + 0.05) / (min(light, other) + 0.05) >= CONTRAST, (ink, paper)
        assert (other < 0.1) is dark, paper


def luminance(colour: str) -> float:
    """Compute the relative luminance of ``rgb(…)`` (WCAG 2.1)."""
    parts = np.array([float(v) for v in re.findall(r"[\d.]+", colour)[:3]]) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_lines_in_the_dark_have_colours_of_the_dark(opened: Browser) -> None:
    stroke = f"getComputedStyle({CHART}.querySelector('path[data-name=optimised]')).stroke"
    opened.look(dark=False)
    light = opened.run(stroke)
    opened.look(dark=True)
    assert luminance(opened.run(stroke)) > luminance(light)


def test_paper_is_white_and_has_no_hints(opened: Browser) -> None:
    opened.look(dark=True, media="print")
    assert opened.run("getComputedStyle(document.documentElement).backgroundColor") == "rgb(255, 255, 255)"
    assert opened.run("getComputedStyle(document.querySelector('.hint')).display") == "none"
