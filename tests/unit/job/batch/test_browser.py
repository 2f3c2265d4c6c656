"""The page that compares jobs in a real browser: it sorts, filters and leads to each job's pages."""

import time

import pytest
from support.browser import NEEDS_BROWSER, Browser, LeftError
from support.patience import PATIENCE

from fiveaxis.job.batch.comparison import write_page
from fiveaxis.job.batch.record import Row, Status

pytestmark = NEEDS_BROWSER
EVIL = '<img src=x onerror="alert(1)">'
FILES = ("preview.html", "report.html")
JOBS = (
    Row("a", "a", Status.FINE, energy=900.0, time=12.0, baseline="normal", locations=10, files=FILES),
    Row("b", "b", Status.FINE, energy=1000.0, time=9.0, baseline="normal", locations=200, files=FILES),
    Row("c", "c", Status.ERRORS, energy=95.5, time=30.0, baseline="normal", locations=30, files=FILES),
    Row("d", "d", Status.BROKEN, message=EVIL),
)
ORDER = "Array.from(document.querySelectorAll('tbody tr:not([hidden])'), r => r.cells[0].innerText).join('')"
MARKS = "Array.from(document.querySelectorAll('.mark'), m => getComputedStyle(m).display !== 'none')"


@pytest.fixture
def page(browser, tmp_path):
    """The page of four jobs, opened from its file."""
    for job in JOBS:
        for name in job.files:
            path = tmp_path / job.name / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(f"<!DOCTYPE html><title>{name} of {job.name}</title>")
    browser.look()
    browser.open(write_page(JOBS, tmp_path).as_uri())
    yield browser
    assert browser.complaints == []


def head(name: str) -> str:
    return f"Array.from(document.querySelectorAll('thead th')).find(th => th.textContent === '{name}')"


def click(page: Browser, what: str) -> None:
    """Click in the middle of an element."""
    at = page.run(
        f"(() => {{ const e = {what}; e.scrollIntoView({{block: 'center', inline: 'center'}}); "
        "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
    )
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        page.ask("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left", clickCount=1)


def wait_for(page: Browser, title: str) -> None:
    """Wait until the browser shows the page of a title."""
    end = time.monotonic() + PATIENCE
    while title_of(page) != title:
        assert time.monotonic() < end, page.run("location.href")
        time.sleep(0.05)


def title_of(page: Browser) -> str:
    """Title of the page that is shown; empty while another one is being opened."""
    try:
        return page.run("document.title")
    except LeftError:
        return ""


def test_a_click_on_a_head_sorts_and_a_second_one_turns_the_order(page):
    energy = head("energy (J)")
    click(page, f"{energy}.querySelector('button')")
    # By number, not by text; what has none is last either way.
    assert page.run(ORDER) == "cabd"
    assert page.run(f"{energy}.getAttribute('aria-sort')") == "ascending"
    click(page, f"{energy}.querySelector('button')")
    assert page.run(ORDER) == "bacd"
    assert page.run(f"{energy}.getAttribute('aria-sort')") == "descending"
    click(page, f"{head('time (s)')}.querySelector('button')")
    assert page.run(ORDER) == "bacd"
    assert page.run("document.querySelectorAll('[aria-sort]').length") == 1


def test_the_keyboard_sorts_too(page):
    page.run(f"{head('locations')}.querySelector('button').focus()")
    page.press(" ", 32)
    assert page.run(ORDER) == "acbd"
    page.press(" ", 32)
    assert page.run(ORDER) == "bcad"


def test_words_and_states_filter_rows_and_marks(page):
    assert sum(page.run(MARKS)) == 3
    click(page, "document.getElementById('words')")
    page.ask("Input.insertText", text="Normal")
    assert page.run(ORDER) == "abc"
    page.run("state.value = 'failed'; state.dispatchEvent(new Event('input'))")
    assert (page.run(ORDER), sum(page.run(MARKS))) == ("c", 1)
    assert page.run("document.getElementById('count').textContent") == "1 of 4 shown"
    page.run("words.value = ''; state.value = 'ok'; state.dispatchEvent(new Event('input'))")
    assert (page.run(ORDER), sum(page.run(MARKS))) == ("ab", 2)


def test_a_mark_names_its_job_and_a_click_opens_its_report(page, tmp_path):
    at = page.run(
        "(() => { const r = document.querySelectorAll('.mark')[2].getBoundingClientRect(); "
        "return [r.x + r.width / 2, r.y + r.height / 2]; })()"
    )
    page.ask("Input.dispatchMouseEvent", type="mouseMoved", x=at[0], y=at[1])
    assert not page.run("tip.hidden")
    assert page.run("tip.textContent").startswith("c, errors, 96")
    click(page, "document.querySelectorAll('.mark')[2]")
    wait_for(page, "report.html of c")


def test_the_links_of_a_row_open_report_and_preview(page):
    click(page, "document.querySelector('tbody tr a[aria-label=\"preview of a\"]')")
    wait_for(page, "preview.html of a")


@pytest.mark.parametrize("width", [320, 700, 1400])
@pytest.mark.parametrize("dark", [False, True])
def test_any_window_has_the_page_without_scrolling_sideways(page, width, dark):
    page.look(width, 800, dark=dark)
    assert page.run("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    sums = "match(/[0-9]+/g).reduce((a, b) => +a + +b)"
    ink, paper = (
        page.run(f"getComputedStyle(document.documentElement).{what}.{sums}")
        for what in ("color", "backgroundColor")
    )
    assert (ink > paper) == dark
