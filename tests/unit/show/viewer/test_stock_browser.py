"""The stock of the preview in a real browser: shown, cut to and fro, coloured."""

import numpy as np
import pytest
from support.browser import NEEDS_BROWSER, Browser
from support.stock_on_page import surface, unpacked

pytestmark = NEEDS_BROWSER
READY = "document.body.dataset.ready === 'yes' || document.querySelector('#fault:not([hidden])') !== null"


@pytest.fixture(scope="module")
def opened(browser: Browser, stock_page, tmp_path_factory) -> Browser:
    file = tmp_path_factory.mktemp("page") / "stock.html"
    file.write_text(stock_page, encoding="utf-8")
    browser.open(file.as_uri(), READY)
    return browser


def drawn(browser: Browser, share: float) -> list[int]:
    """Seek, and give number and checksum of the corners that are drawn."""
    browser.run(f"show.seek({share} * show.result.duration)")
    return browser.run(
        "(g => { const n = g.drawRange.count; let sum = 0;"
        " for (let k = 0; k < n; k++) sum = (31 * sum + g.index.array[k]) % 1000003;"
        " return [n, sum]; })(show.stock.mesh.geometry)"
    )


def test_the_page_loads_without_an_error_and_shows_the_stock(opened, tmp_path):
    assert opened.run("document.body.dataset.ready") == "yes"
    assert opened.run("pick('#fault').hidden") is True
    assert opened.complaints == []
    opened.run("pick('input[value=part]').click()")
    for node, there in (("workpiece/stock", "true"), ("workpiece/part", "false")):
        assert opened.run(f"child(show.stage.group, '{node}').visible === {there}") is True
    full = opened.shoot(tmp_path / "full.png")
    opened.run("pick('[data-node=\"workpiece/stock\"]').click()")
    bare = opened.shoot(tmp_path / "bare.png")
    opened.run("pick('[data-node=\"workpiece/stock\"]').click()")
    assert (np.abs(full - bare).max(axis=2) > 0.05).mean() > 0.01


def test_the_slider_goes_back_and_forth(opened, stock_page):
    head, arrays = unpacked(stock_page)
    shares = [0.0, 0.3, 0.31, 0.8, 1.0]
    forth = [drawn(opened, share) for share in shares]
    back = [drawn(opened, share) for share in shares[::-1]][::-1]
    assert forth == back
    steps = [int(share * 2000 + 1e-6) for share in shares]
    assert [n for n, _ in forth] == [3 * len(surface(head, arrays, step).faces) for step in steps]
    assert opened.complaints == []


def test_the_removal_rate_is_read_and_drawn_over_time(opened, stock_page):
    _, arrays = unpacked(stock_page)
    rate = arrays["stock/rate"]
    opened.run("show.seek(0.5 * show.result.duration)")
    text = opened.run("pick('tr[data-figure=removal] .value').textContent")
    assert float(text.removesuffix(" mm³/s").replace(",", "")) == pytest.approx(rate[1000], abs=0.051)
    violet = (
        "(c => { const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
        " for (let k = 0; k < p.length; k += 4)"
        " n += p[k] === 0xb4 && p[k + 1] === 0x8c && p[k + 2] === 0xff; return n; })(pick('#curves'))"
    )
    assert opened.run(violet) > 100
    assert opened.complaints == []


def test_the_map_is_switched_on_and_off(opened, tmp_path):
    opened.run("show.seek(show.result.duration)")
    on = opened.shoot(tmp_path / "on.png")
    opened.run("pick('#map').click()")
    off = opened.shoot(tmp_path / "off.png")
    assert opened.run("show.stock.mesh.material.vertexColors") is False
    opened.run("pick('#map').click()")
    assert (np.abs(on - off).max(axis=2) > 0.05).mean() > 0.01
    assert opened.complaints == []
