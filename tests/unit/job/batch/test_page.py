"""The page that compares jobs: its links, and that text from files stays text."""

import re
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from fiveaxis.job.batch.comparison import MOST_BARS, draw_variants, write_comparison, write_page
from fiveaxis.job.batch.record import Row, Status
from fiveaxis.show.report.plots import LONGEST

EVIL = '<img src=x onerror="alert(1)">'
FILES = ("motion.csv", "preview.html", "report.html", "report.json")


def row(name: str, energy: float | None = None, time: float = 10.0, **more: Any) -> Row:
    """A job's row; with an energy it has a report and a preview."""
    known = {} if energy is None else {"energy": energy, "time": time, "files": FILES}
    status = Status.BROKEN if energy is None else Status.FINE
    return Row(**{"name": name, "file": f"{name}.toml", "status": status} | known | more)


def links(page: Path) -> list[Path]:
    """The files that a page's links lead to."""
    return [
        page.parent / unquote(unescape(link))
        for link in re.findall(r'href="([^"]*)"', page.read_text("utf-8"))
    ]


def place(folder: Path, *rows: Row) -> None:
    """Make the files of some jobs."""
    for each in rows:
        for name in each.files:
            path = folder / each.name / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"<!DOCTYPE html><title>{name} of {each.name.replace('<', '')}</title>")


@pytest.mark.parametrize("name", ["cup/tilt=15,75", "ä 100%#?&\"'", "javascript:alert(1)", EVIL])
def test_links_lead_to_the_jobs_own_pages_from_where_the_page_is(tmp_path, name):
    own = row(name, 100.0)
    place(tmp_path, own)
    found = links(write_page([own], tmp_path))
    assert sorted({path.name for path in found}) == ["preview.html", "report.html"]
    assert all(path.is_file() for path in found)
    if "/" in name:
        sweep = write_comparison("cup", [own], tmp_path).files[0]
        assert all(path.is_file() for path in links(sweep))


def test_a_job_without_files_has_no_links_and_no_mark(tmp_path):
    text = write_page([row("a", 100.0), row("b", message="killed its workers")], tmp_path).read_text("utf-8")
    assert text.count('class="mark') == 1
    assert "1 job has no energy and no mark" in text
    assert "b/report.html" not in text
    assert "killed its workers" in text


def test_text_from_files_is_text(tmp_path):
    rows = [
        row("a", 100.0, message=EVIL, baseline=EVIL, sweep="a", values={EVIL: EVIL}),
        row("b", 90.0, sweep="a", values={EVIL: 3}),
    ]
    for page in (
        write_comparison(EVIL, rows, tmp_path).files[0],
        write_page(rows, tmp_path),
    ):
        text = page.read_text("utf-8")
        assert "<img" not in text
        assert text.count("<script>") == 1


def test_nothing_is_loaded_from_elsewhere_and_no_foreign_script_runs(tmp_path):
    text = write_page([row("a", 100.0)], tmp_path).read_text("utf-8")
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy.startswith("default-src 'none'; style-src 'sha256-")
    assert "unsafe" not in policy
    assert not re.search(r"https?:|//[a-z]", text)


def variant(value: object, energy: float | None, **more: Any) -> Row:
    """A variant of a sweep over tilts, compared with the normal."""
    baseline = {"baseline": "normal", "baseline_energy": 14610.0}
    return row("v", energy, values={"tilt": value}, **baseline | more)


def test_each_variant_shows_its_energy_or_why_it_has_none():
    none = variant(1, None, status=Status.NO_POSTURE, baseline="", baseline_energy=None)
    figure = draw_variants("cup", [variant(15, 8151.4), none])
    for message in ("8\u2009151 J", "no posture", "tilt 15", "tilt 1", "normal", "optimised", "(J)", "cup"):
        assert message in figure
    assert "no posture" in draw_variants("cup", [none])
    assert draw_variants("cup", [variant(15, 8151.4), none]) == figure


def test_names_in_the_figure_are_no_markup():
    figure = draw_variants("<b>$x$", [variant("$a$ <script> " + "y" * 99, 1.0)])
    assert "<script" not in figure
    assert "$a$ &lt;script&gt;" in figure
    assert "&lt;b&gt;$x$" in figure
    assert "y" * LONGEST not in figure


def test_of_more_bars_than_are_legible_the_first_are_drawn_and_the_title_says_so():
    figure = draw_variants("cup", [variant(f"v{i}", 1.0) for i in range(MOST_BARS + 5)])
    assert f"the first {MOST_BARS} of {MOST_BARS + 5}" in figure
    assert len(re.findall(r">tilt v\d+<", figure)) == MOST_BARS
