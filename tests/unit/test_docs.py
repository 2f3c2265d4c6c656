"""The examples of README and documentation run, and print what they say; `.ci/run` builds the site."""

import doctest
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

import pytest
from support.patience import PATIENCE
from typer.testing import CliRunner

from fiveaxis.cli.commands import VERBS, app

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted((DOCS / "pages").rglob("*.md"))
README = ROOT / "README.md"
# Their files and results are what the other pages go on from.
FIRST = [DOCS / "pages/my-machine.md", DOCS / "pages/my-part.md"]
# Between a number on a page and the one that a run prints: libraries and processors round differently.
TOLERANCE = 0.02
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
FENCE = re.compile(r"^```(\{code-block\} )?(\w+)\n(?::caption: (\S+)\n\n?)?(.*?)^```$", re.M | re.S)
# A file of the repository that a page shows under its own name, and goes on with.
INCLUDED = re.compile(r"^```\{literalinclude\} (\S+)\n:caption: (\S+)$", re.M)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page.

    Parameters
    ----------
    language : ``console``, ``python``, ``toml`` …
    caption : name of the file that a block with one is
    text : what stands in it
    line : of the page, where it begins
    """

    language: str
    caption: str | None
    text: str
    line: int


def blocks_of(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(found[2], found[3], found[4], text.count("\n", 0, found.start()) + 1)
        for found in FENCE.finditer(text)
    ]


def commands_of(block: Block) -> list[tuple[str, str]]:
    """Give the commands of a console block, each with what it prints."""
    commands: list[tuple[str, str]] = []
    for line in block.text.splitlines():
        if line.startswith("$ "):
            commands.append((line[2:], ""))
        else:
            command, printed = commands[-1]
            commands[-1] = (command, f"{printed}{line}\n")
    return commands


def matches(got: str, want: str) -> bool:
    """Tell whether a text is the wanted one; ``...`` is any text, and numbers may differ by `TOLERANCE`."""
    pieces = [_pattern(piece) for piece in " ".join(want.split()).split("...")]
    found = re.fullmatch(".*?".join(pieces), " ".join(got.split()))
    if found is None:
        return False
    return all(
        abs(float(a) - float(b)) <= TOLERANCE * max(abs(float(b)), 1.0)
        for a, b in zip(found.groups(), NUMBER.findall(want.replace("...", " ")), strict=True)
    )


def _pattern(text: str) -> str:
    """Write a pattern in which every number is a group."""
    pieces = re.split(f"({NUMBER.pattern})", text)
    return "".join(f"({NUMBER.pattern})" if n % 2 else re.escape(piece) for n, piece in enumerate(pieces))


class Checker(doctest.OutputChecker):
    """A doctest's comparison that allows numbers the same tolerance."""

    def check_output(self, want: str, got: str, optionflags: int) -> bool:
        return matches(got, want)


def run_page(page: Path, folder: Path) -> None:
    """Run what a page shows, block by block, in a folder."""
    names: dict[str, object] = {}
    for path, caption in INCLUDED.findall(page.read_text(encoding="utf-8")):
        if caption == Path(path).name:
            shutil.copy(page.parent / path, folder)
    for block in blocks_of(page):
        place = f"{page.relative_to(ROOT)}:{block.line}"
        if block.caption is not None:
            folder.joinpath(block.caption).write_text(block.text, encoding="utf-8")
        elif block.language == "console":
            for command, printed in commands_of(block):
                assert matches(got := run_command(command, folder), printed), f"{place}: {command}\n{got}"
        elif block.language == "python" and ">>>" in block.text:
            run_doctest(block, names, folder, place)


def run_command(command: str, folder: Path) -> str:
    """Run a command and return what it prints.

    One of fiveaxis runs in this process, where its libraries are loaded; any other, or a pipe, in a shell.
    """
    words = shlex.split(command)
    if words[0] != "fiveaxis" or "|" in words:
        return run_in_shell(command, folder)
    end = min((words.index(sign) for sign in (">", "2>") if sign in words), default=len(words))
    with chdir(folder):
        done = CliRunner(env={"COLUMNS": "100"}).invoke(app, words[1:end])
        files = dict(zip(words[end::2], words[end + 1 :: 2], strict=True))
        for sign, printed in ((">", done.stdout), ("2>", done.stderr)):
            if sign in files:
                Path(files[sign]).write_text(printed, encoding="utf-8")
    assert done.exit_code == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return "" if ">" in files else done.stdout


def run_in_shell(command: str, folder: Path) -> str:
    tools = str(Path(sys.executable).parent)
    environment = os.environ | {"COLUMNS": "100", "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"}
    shell = ["bash", "-o", "pipefail", "-c", command]
    done = subprocess.run(
        shell, cwd=folder, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def run_doctest(block: Block, names: dict[str, object], folder: Path, place: str) -> None:
    test = doctest.DocTestParser().get_doctest(block.text, names, place, place, 0)
    said: list[str] = []
    with chdir(folder):
        runner = doctest.DocTestRunner(Checker(), verbose=False)
        runner.run(test, out=said.append, clear_globs=False)
    names.update(test.globs)
    assert runner.failures == 0, "".join(said)


def uses_commands(page: Path) -> bool:
    return any(block.language == "console" for block in blocks_of(page))


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """Give the folder that the first pages leave; the others go on from there.

    With several test processes one of them runs these pages, and the others wait for it.
    """
    if "PYTEST_XDIST_WORKER" not in os.environ:
        folder = tmp_path_factory.mktemp("first-pages")
        run_first(folder)
        return folder
    folder = tmp_path_factory.getbasetemp().parent / "first-pages"
    whole = folder.with_name("first-pages-whole")
    failed = folder.with_name("first-pages-failed")
    try:
        folder.mkdir()
    except FileExistsError:
        deadline = time.monotonic() + PATIENCE
        while not whole.exists():
            assert not failed.exists(), "the first pages failed in another test process"
            assert time.monotonic() < deadline, "the first pages aren't done after 10 minutes"
            time.sleep(0.2)
        return folder
    try:
        run_first(folder)
    except BaseException:
        failed.touch()
        raise
    whole.touch()
    return folder


def run_first(folder: Path) -> None:
    for page in FIRST:
        run_page(page, folder)


@pytest.mark.slow
def test_machine_and_part_are_described_as_it_is_printed(finished):
    assert (finished / "out/program.nc").is_file()


@pytest.mark.slow
def test_the_readme_s_commands_print_what_it_says(tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    run_page(README, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [p for p in PAGES if p not in FIRST and uses_commands(p)], ids=lambda page: page.stem
)
def test_the_commands_of_a_page_print_what_it_says(page, finished, tmp_path):
    folder = tmp_path / "work"
    shutil.copytree(finished, folder)
    run_page(page, folder)


@pytest.mark.parametrize(
    "page",
    [p for p in PAGES if not uses_commands(p) and any(">>>" in b.text for b in blocks_of(p))],
    ids=lambda page: page.stem,
)
def test_the_python_of_a_page_prints_what_it_says(page, tmp_path):
    run_page(page, tmp_path)


def test_numbers_of_a_page_may_differ_by_the_tolerance_and_words_may_not():
    assert matches("saved 79.1 % in 4 s", "saved 79.0 % in ... s")
    assert not matches("saved 70.0 % in 4 s", "saved 79.0 % in ... s")
    assert not matches("spent 79.0 % in 4 s", "saved 79.0 % in ... s")


@pytest.fixture(scope="module")
def formats():
    """Load `docs/formats.py`, which isn't in a package."""
    spec = importlib.util.spec_from_file_location("docs_formats", DOCS / "formats.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def test_every_key_of_a_job_is_on_its_page(formats):
    from fiveaxis.job import list_job_entries

    text = formats.pages()["job"]
    for entry in list_job_entries():
        if entry.key == "sweep":
            assert "## `[sweep]`" in text
            continue
        table, _, name = entry.key.rpartition(".")
        headers = (f"## `[{table}]`", f"## `[[{table}]]`") if table else ("## Top of the file",)
        sections = [part for part in f"\n{text}".split("\n## ") if f"## {part}".startswith(headers)]
        assert any(f"\n| `{name}` |" in section for section in sections), entry.key


def test_every_key_of_the_library_s_machines_and_of_the_tools_is_on_its_page(formats):
    import tomllib

    from fiveaxis.model.toolpath.tool import HolderTable, SectionTable, ToolTable

    pages = formats.pages()
    for path in (ROOT / "machines").glob("*.toml"):
        for key in _keys(tomllib.loads(path.read_text(encoding="utf-8"))) - set("XYZABC"):
            assert f"\n| `{key}` |" in pages["machine"], f"{path.name}: {key}"
    for model in (ToolTable, HolderTable, SectionTable):
        for key in model.model_fields:
            assert f"\n| `{key}` |" in pages["tool"], key


def test_every_key_of_the_library_s_controls_is_on_its_page(formats):
    import tomllib

    text = formats.pages()["control"]
    named = {"feed", "modes", "arcs", "cycles", "refused", "coolant", "unit", "most", "winding_notes"}
    for path in (ROOT / "fiveaxis/nc/controls").glob("*.toml"):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        plain = {key: value for key, value in data.items() if key not in named}
        plain["comment"] = {k: v for k, v in data.get("comment", {}).items() if k != "active"}
        inner = [table for key in ("feed", "modes", "arcs") for table in data.get(key, {}).values()]
        for key in set(data) | _keys(plain).union(*map(_keys, inner)) - {"based_on"}:
            assert f"\n| `{key}` |" in text, f"{path.name}: {key}"


def _keys(value: object) -> set[str]:
    if isinstance(value, dict):
        return set(value).union(*map(_keys, value.values()))
    return set().union(*map(_keys, value)) if isinstance(value, list) else set()


def test_a_key_without_a_meaning_stops_the_build(formats):
    from pydantic import BaseModel

    class Said(BaseModel):
        """A table."""

        silent: float

    with pytest.raises(formats.KeyFault, match=r"Said\.silent has no description"):
        formats.list_tables(Said, formats.Meanings())


def test_a_meaning_that_nobody_needs_stops_the_build(formats, tmp_path):
    file = tmp_path / "keys.toml"
    file.write_text('"Said.gone" = "nothing"\n')
    with pytest.raises(formats.KeyFault, match=r"Said\.gone"):
        formats.Meanings(file).require_used()


def test_each_command_stands_in_the_list_of_commands():
    listed = (DOCS / "pages" / "commands.md").read_text(encoding="utf-8")
    assert [verb for verb in VERBS if f"\nfiveaxis {verb} " not in listed] == []
