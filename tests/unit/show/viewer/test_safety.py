"""What comes from files stays text, and nothing that comes from files is run."""

import ast
import base64
import gzip
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

import fiveaxis
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import Fixture, Surroundings
from fiveaxis.model import Box
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside

NASTY = "</script><script>alert(1)</script><img src=x onerror=\"alert('2')\">"
# They run what they read.
RUNNERS = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib"}
# A batch hands its tasks to its own workers, through pipes that nobody else can open, and stores none.
THROUGH_PIPES = {"batch/pool.py", "batch/worker.py"}


@pytest.fixture(scope="module")
def page(solution, part) -> str:
    """A page where every name that comes from a file tries to be more than a name."""
    path = replace(solution.toolpath, name=f"dir\\{NASTY}")
    machine = replace(solution.machine, name=NASTY)
    shown = replace(solution, toolpath=path, machine=machine)
    around = Surroundings(part=part, fixtures=(Fixture(NASTY, Box((5.0, 5.0, 5.0), (80.0, 0.0, 0.0))),))
    finding = Finding(Severity.ERROR, NASTY, NASTY, Place(3, 4, NASTY))
    return render_page(shown, Beside(surroundings=around, findings=[finding]))


class Tags(HTMLParser):
    """Tags and attributes, as a browser would take them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.handlers: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.handlers += [name for name, _ in attrs if name.startswith("on")]


def test_nasty_names_make_no_tag_and_no_handler(page, solution):
    plain, nasty = Tags(render_page(solution)), Tags(page)
    assert nasty.tags.count("script") == plain.tags.count("script")
    assert "img" not in nasty.tags
    assert nasty.handlers == []
    assert NASTY not in page


def test_what_the_script_reads_is_packed_data(page):
    packed = re.search(r'<script type="text/plain" id="scene">\n([A-Za-z0-9+/=]+)\n</script>', page)
    assert packed is not None
    content = gzip.decompress(base64.b64decode(packed[1]))
    length = int.from_bytes(content[:4], "little")
    head = json.loads(content[4 : 4 + length])
    sizes = [*head["commands"], *(section["size"] for section in head["sections"].values())]
    assert len(content) == 4 + length + sum(sizes)


def test_a_script_of_the_page_never_makes_markup_or_code_of_text():
    words = ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "Function(")
    scripts = (Path(fiveaxis.__file__).parent / "show" / "viewer" / "scripts").glob("*.js")
    texts = {script.name: script.read_text(encoding="utf-8") for script in scripts}
    assert len(texts) > 1
    assert [(name, word) for name, text in texts.items() for word in words if word in text] == []


def test_nothing_that_was_stored_is_run():
    found = {}
    for path in Path(fiveaxis.__file__).parent.rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
        runners = RUNNERS - ({"pickle"} if "/".join(path.parts[-2:]) in THROUGH_PIPES else set())
        passed = {node.arg for node in nodes if isinstance(node, ast.keyword)}
        found[str(path)] = runners & {name.partition(".")[0] for name in names} | passed & {"allow_pickle"}
    assert {path: words for path, words in found.items() if words} == {}
