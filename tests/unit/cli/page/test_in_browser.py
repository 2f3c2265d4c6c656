"""The page in a real browser: a program, a part, refusals, by keyboard alone, and with the server killed."""

import json
import signal
from pathlib import Path

import pytest
from support.browser import NEEDS_BROWSER
from support.served_page import SIZE, ServedPage, Visitor
from support.shop_programs import SHOPS

pytestmark = NEEDS_BROWSER

PART = Path(__file__).parents[4] / "examples" / "overhang" / "part.stl"
NOTES = ("(T3 D=6. CR=3. - BALL END MILL)", "(T5 - 8MM BALL MILL)")
SIZES = (SIZE, (900, 900))


@pytest.fixture
def page():
    served = ServedPage()
    yield served
    if served.process.poll() is None:
        served.close()


@pytest.fixture
def program(tmp_path):
    """Five operations, two of them in five axes with tools that comments state."""
    path = tmp_path / "bracket.nc"
    path.write_text("\n".join(SHOPS["fanuc"].lines(9, NOTES)) + "\n")
    return path


def test_a_program_is_dropped_seen_improved_and_downloaded(browser, page, program):
    visitor = Visitor(browser, page, SIZES[1])
    visitor.drop(program)
    visitor.wait("document.querySelector('#dropped').textContent === 'bracket.nc'")
    visitor.click("[data-machine=dmu50ev]")
    visitor.click("#look")
    visitor.wait_for("#seen")
    assert browser.run("document.querySelectorAll('#seen tr b').length") == 2
    visitor.wait_for("#watch")
    as_it_is = page.ask("GET", "/state")[1]["seen"]["totals"]
    assert browser.run("document.querySelector('#watch iframe').getAttribute('sandbox')") == "allow-scripts"
    browser.run("document.querySelector('#effort').value = 'quick'")
    visitor.click("#go")
    visitor.wait_for("#result")
    if "already better" in visitor.text("#result"):
        visitor.click("#trade")
        visitor.wait("document.querySelector('#get')")
    before = page.ask("GET", "/state")[1]["end"]["result"]["before"]
    assert before == pytest.approx(as_it_is)
    name = browser.run("document.querySelector('#get').getAttribute('href')")
    assert name.endswith("as=bracket-improved.nc")
    status, made, _ = page.ask("GET", name)
    assert status == 200
    assert made.decode().splitlines()[:4] == program.read_text().splitlines()[:4]
    assert made != program.read_bytes()
    for size in SIZES:
        browser.look(*size)
        assert browser.run("document.documentElement.scrollWidth <= innerWidth"), size
    assert not browser.complaints


def test_a_part_becomes_a_program(browser, page):
    visitor = Visitor(browser, page, SIZES[1])
    visitor.drop(PART)
    visitor.wait("document.querySelector('#dropped').textContent === 'part.stl'")
    visitor.click("[data-machine='hayashi-640123']")
    visitor.click("#look")
    visitor.wait("document.querySelector('#ask .d')")
    visitor.click("#go")
    assert "diameter" in visitor.text("#fault")
    script = "document.querySelector('{}').value = '{}'"
    for css, value in ((".d", "8"), ("#stepdown", "8"), ("#effort", "quick")):
        browser.run(script.format(css, value))
    visitor.click("#go")
    visitor.wait_for("#result")
    assert "than with the baseline" in visitor.text("#result .verdict")
    assert page.ask("GET", browser.run("document.querySelector('#get').getAttribute('href')"))[0] == 200
    visitor.click("#result [role=tab]:nth-child(2)")
    visitor.wait("document.querySelector('#result iframe').src.endsWith('report.html')")
    assert not browser.complaints


def test_what_cannot_be_used_is_refused_in_a_sentence(browser, page, program, tmp_path):
    visitor = Visitor(browser, page)
    other = tmp_path / "other.nc"
    other.write_text("G0 X0\n")
    visitor.drop(program, other)
    visitor.wait("document.querySelector('.fault')")
    assert "one program at a time: here are bracket.nc and other.nc" in visitor.text("#fault")
    binary = tmp_path / "tool"
    binary.write_bytes(b"\x7fELF\x02\x01" + bytes(99))
    visitor.drop(binary)
    visitor.wait("document.querySelector('#dropped').textContent === 'tool'")
    visitor.click("[data-machine=dmu50ev]")
    visitor.click("#look")
    visitor.wait("document.querySelector('.fault')")
    assert "isn't a text file" in visitor.text("#fault")
    assert browser.run("!document.querySelector('#choose').hidden")
    big = "new File([new Uint8Array(1)], 'big.nc')"
    browser.run(
        f"(() => {{ const f = {big}; Object.defineProperty(f, 'size', {{value: 3e8}}); take([f]); }})()"
    )
    assert "300 MB" in visitor.text("#fault")
    assert "200 MB" in visitor.text("#fault")


def test_it_can_be_used_by_keyboard_alone(browser, page, program):
    visitor = Visitor(browser, page)
    visitor.drop(program)
    visitor.wait("document.querySelector('#dropped').textContent === 'bracket.nc'")
    focused = "document.activeElement.id || document.activeElement.dataset.machine || ''"
    seen = []
    for _ in range(40):
        visitor.press("Tab", 9)
        seen.append(browser.run(focused))
        if seen[-1] == "dmu50ev":
            browser.ask("Input.dispatchKeyEvent", type="char", text=" ")
            browser.run("document.activeElement.click()")
        if seen[-1] == "look":
            break
    assert seen[0] == "file"
    assert "dmu50ev" in seen
    assert seen[-1] == "look"
    ring = "getComputedStyle(document.activeElement).outlineStyle"
    assert browser.run(ring) != "none"
    browser.ask("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r")
    visitor.wait_for("#watch")
    for _ in range(40):
        visitor.press("Tab", 9)
        if browser.run(focused) == "go":
            break
    assert browser.run(focused) == "go"


def test_a_second_window_sees_the_work_of_the_first(browser, page, program):
    visitor = Visitor(browser, page)
    ask = {"program": page.put(program), "machine": "dmu50ev", "effort": "thorough", "cone": 40}
    assert page.ask("POST", "/run/improve", json.dumps(ask).encode())[0] == 200
    browser.open(page.address)
    visitor.wait("!document.querySelector('#busy').hidden")
    assert "another window" in visitor.text("#doing")
    visitor.click("#cancel")
    visitor.wait("document.querySelector('#busy').hidden")
    visitor.wait("document.querySelectorAll('.tile').length > 3")


def test_a_killed_server_is_told(browser, page, program):
    visitor = Visitor(browser, page)
    visitor.drop(program)
    visitor.wait("document.querySelector('#dropped').textContent === 'bracket.nc'")
    visitor.click("[data-machine=dmu50ev]")
    page.close(signal.SIGKILL)
    visitor.click("#look")
    visitor.wait("document.querySelector('.fault')")
    assert "fiveaxis app has ended. Start it again" in visitor.text("#fault")
