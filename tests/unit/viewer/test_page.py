"""The page: one file, the same each time, and nothing in it from elsewhere."""

import re
import shutil
import subprocess
import threading
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from fiveaxis.errors import SettingError
from fiveaxis.viewer import render_page, write_preview

CHROMIUM = shutil.which("chromium")
LARGEST = 15e6  # byte, for 20 000 locations
HEADLESS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=900,600",
    "--virtual-time-budget=5000",
]


class Tags(HTMLParser):
    """Every tag with its attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


@pytest.fixture(scope="module")
def page(solution, part) -> str:
    return render_page(solution, part=part)


def test_two_writes_are_byte_identical(solution, part, tmp_path):
    first = write_preview(solution, tmp_path / "a.html", part=part)
    second = write_preview(solution, tmp_path / "b.html", part=part)
    assert first.read_bytes() == second.read_bytes()


def test_no_tag_fetches_anything(page):
    for tag, attributes in Tags(page).found:
        assert tag not in {"link", "iframe", "img", "base", "object", "embed"}
        assert not {"src", "href", "srcset"} & set(attributes), (tag, attributes)


def test_the_browser_is_told_to_fetch_nothing(page):
    policies = [a["content"] for t, a in Tags(page).found if a.get("http-equiv") == "Content-Security-Policy"]
    assert len(policies) == 1
    assert policies[0].startswith("default-src 'none'")
    assert "http" not in policies[0]


def test_no_server_process_and_no_thread_is_left(solution, part, monkeypatch):
    def refuse(*args, **kwargs):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    before = threading.active_count()
    render_page(solution, part=part)
    assert threading.active_count() == before


def test_names_are_escaped_and_no_folder_is_told(page):
    assert "&lt;ring&gt; &amp; co.csv" in page
    assert "<ring>" not in page
    assert "/some/folder" not in page


def test_the_legend_says_what_both_postures_cost(page, solution):
    legend = re.search(r'<div id="legend">.*?</div></div>', page, re.DOTALL)
    assert legend is not None
    assert f"{solution.energy.total:,.0f} J" in legend[0]
    assert f"normal {solution.compared['normal'].energy.total:,.0f} J" in legend[0]
    assert "J/mm" in legend[0]


def test_without_part_and_baseline_there_are_no_boxes_for_them(solution):
    boxes = [a["value"] for t, a in Tags(render_page(replace(solution, compared={}))).found if t == "input"]
    assert boxes == ["/meshcat/fiveaxis/after"]


def test_twenty_thousand_locations_stay_below_the_largest_page(solution, part):
    assert len(render_page(long_solution(solution, 20_000), part=part)) < LARGEST


def long_solution(solution, n: int):
    rows = np.linspace(0, len(solution.toolpath) - 1, n).astype(int)
    path, motion = solution.toolpath, solution.motion
    names = ("pivot", "contact", "normal", "axis", "feed", "kind", "source")
    longer = replace(path, **{name: getattr(path, name)[rows] for name in names})
    names = ("positions", "feed", "time", "kind", "source")
    moved = replace(motion, **{name: getattr(motion, name)[rows] for name in names})
    baseline = solution.compared["normal"]
    return replace(
        solution, toolpath=longer, motion=moved, compared={"normal": replace(baseline, motion=moved)}
    )


def test_a_place_that_cannot_be_written_is_an_error(solution, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SettingError, match="can't be written"):
        write_preview(solution, tmp_path / "file" / "page.html")


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium on the path")
def test_chromium_draws_part_path_and_tool(solution, part, tmp_path):
    from matplotlib.image import imread

    page = write_preview(solution, tmp_path / "page.html", part=part)
    shot = tmp_path / "shot.png"
    command = [CHROMIUM, *HEADLESS, f"--user-data-dir={tmp_path / 'user'}", "--enable-logging=stderr"]
    done = subprocess.run(
        [*command, f"--screenshot={shot}", page.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert "Uncaught" not in done.stderr
    assert "Content Security Policy" not in done.stderr
    picture = imread(shot)[:, 400:, :3]
    bright = picture.min(axis=2) > 0.3
    saturated = picture.max(axis=2) - picture.min(axis=2) > 0.2
    assert bright.mean() > 0.05, "neither part nor tool"
    assert saturated.sum() > 100, "no coloured path"
