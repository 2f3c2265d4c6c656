"""The preview in the output of a notebook: a frame of its own that needs no server, in a real browser too."""

import os
import socket
import sys
import time
import webbrowser
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.browser import CHROMIUM, Browser
from support.patience import PATIENCE

from fiveaxis.show import Preview, preview
from fiveaxis.show.viewer.serving import MOST_INLINE

# What Jupyter puts around an output, as far as it matters here.
NOTEBOOK = (
    "<!DOCTYPE html><html><head><title>notebook</title></head><body><h1>cells</h1>{output}</body></html>"
)


@pytest.fixture
def opened(monkeypatch) -> list[str]:
    """Collect the addresses that would be opened in the user's browser."""
    urls: list[str] = []
    monkeypatch.setattr(webbrowser, "open", urls.append)
    return urls


def run_in(monkeypatch, shell: object) -> None:
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))


def frame_of(html: str) -> dict[str, Any]:
    """Give the attributes of the one element of an output."""
    found = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attrs):
            found.append((tag, dict(attrs)))

    Reader().feed(html)
    [(tag, attributes)] = found
    assert tag == "iframe"
    return attributes


def test_the_output_has_the_whole_page_in_a_frame_that_cant_reach_the_notebook(solution):
    with preview(solution, open_browser=False) as shown:
        frame = frame_of(shown._repr_html_())
        assert frame["srcdoc"] == shown.page
        assert frame["sandbox"] == "allow-scripts"
        assert "Content-Security-Policy" in frame["srcdoc"]
        assert len(repr(shown)) < 100


def test_a_page_too_large_for_a_notebook_is_a_note():
    with Preview("x" * (MOST_INLINE + 1)) as shown:
        assert "20 MB, too much for a notebook" in shown._repr_html_()
        assert shown.url() in shown._repr_html_()


@pytest.mark.parametrize("shell", [None, object()], ids=["plain Python", "IPython"])
def test_a_window_opens_in_plain_python_only(solution, opened, monkeypatch, shell):
    run_in(monkeypatch, shell)
    with preview(solution) as shown:
        assert opened == ([] if shell else [shown.url()])
    with preview(solution, open_browser=True) as shown:
        assert opened[-1] == shown.url()


def test_a_cell_ends_at_once_and_waiting_in_it_too(solution, opened, monkeypatch):
    """Otherwise this test doesn't end."""
    run_in(monkeypatch, object())
    shown = preview(solution)
    shown.wait()
    shown.close()


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium on the path")
def test_the_scene_is_there_in_a_notebook_without_a_server(browser: Browser, solution, tmp_path):
    shown = preview(solution, open_browser=False)
    page = tmp_path / "notebook.html"
    page.write_text(NOTEBOOK.format(output=shown._repr_html_()), encoding="utf-8")
    port = int(shown.url().rstrip("/").rpartition(":")[2])
    shown.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
    browser.open(page.as_uri())
    outer, browser.session = browser.session, None
    end = time.monotonic() + PATIENCE
    while not (
        frames := [t for t in browser.ask("Target.getTargets")["targetInfos"] if t["type"] == "iframe"]
    ):
        assert time.monotonic() < end, "the frame isn't there"
        time.sleep(0.05)
    attached = browser.ask("Target.attachToTarget", targetId=frames[0]["targetId"], flatten=True)
    browser.session = attached["sessionId"]
    for domain in ("Runtime", "Log"):
        browser.ask(f"{domain}.enable")
    while not browser.run("document.body !== null && document.body.dataset.ready === 'yes'"):
        assert time.monotonic() < end, f"the scene isn't ready: {browser.complaints}"
        time.sleep(0.05)
    assert browser.run("pick('#fault').hidden") is True
    # The frame is a stranger to the notebook: it reads nothing of it.
    assert (
        browser.run("(() => { try { return parent.document.title } catch (e) { return 'denied' } })()")
        == "denied"
    )
    assert browser.complaints == []
    browser.session = outer
    kept = os.environ.get("FIVEAXIS_KEEP_PICTURES")
    picture = browser.shoot(Path(kept or tmp_path) / "notebook.png")
    assert picture[120:, 50:1150].std() > 0.05, "the frame is blank"
