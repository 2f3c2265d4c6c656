"""What several tests share: the real inputs and the machines."""

import gc
import os
import re
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from support.browser import Browser

from fiveaxis.model import Machine, Tool, Toolpath, load_machine

# The same examples every time: some at each push, more before a merge (`--hypothesis-profile=merge`). How
# long they take to draw is no property of the code, as machines are shared. What a test writes to its own
# folder for one example, it overwrites for the next.
for profile, examples in {"push": 20, "merge": 60}.items():
    settings.register_profile(
        profile,
        derandomize=True,
        max_examples=examples,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
    )
settings.load_profile("push")

# There is hardly any garbage while tests are collected, and looking for it takes half of the time.
gc.disable()

SHARED = Path(__file__).parents[2] / "shared"
# s of processor time, of a test with its processes, where all loops are compiled: a longer one is `slow`.
# Those that were measured so are listed; FIVEAXIS_WRITE_SLOW=1 adds what a run finds.
BOUND, MEASURED = 1.0, Path(__file__).with_name("slow.txt")
# What is run first, and compiles most loops; and rooms of `unit` that compile hardly anything.
COMPILING = "test_program_truth.py"
UNCOMPILED = {"kinematics", "machine", "nc", "toolpath"}
# The files that take longest, in this order: at the end of a run no process works on one while another has
# nothing left. The first waits for a simulated machine: meanwhile `.ci/run` has other checks to do.
LONGEST = (
    "test_linuxcnc.py",
    "test_faults_of_controls.py",
    "test_docs.py",
    "test_lower_bound.py",
    "test_flow.py",
    "test_cad.py",
    "test_processors.py",
    "test_sweep.py",
    "test_in_browser.py",
    "test_server.py",
    "test_approach.py",
    "test_reoptimise.py",
    "test_revised_program.py",
    "test_calibration.py",
)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let one of two processes compile while the other runs what needs no loops; mark `slow` and `shared`.

    In a fresh checkout both would compile the optimiser's loops at the same time. Processes take whole files
    (`--dist loadfile`), so a file's fixtures are made once; the longest come before the others.
    """

    def turn(item: pytest.Item) -> int:
        if item.path.name == COMPILING:
            return 0
        if UNCOMPILED & set(item.path.parts):
            return 1
        return 2 + (LONGEST.index(item.path.name) if item.path.name in LONGEST else len(LONGEST))

    items.sort(key=turn)
    measured = set(MEASURED.read_text(encoding="utf-8").splitlines())
    for item in items:
        if short(item.nodeid) in measured:
            item.add_marker("slow")
        if "data" in getattr(item, "fixturenames", ()):
            item.add_marker("shared")


def pytest_collection_finish() -> None:
    """Collect garbage again, but nothing of what was imported and collected, and more rarely."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


def short(nodeid: str) -> str:
    """Name a test by its file and itself: folders may change."""
    return re.sub(r"^[^\[]*/", "", nodeid)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None]:
    """Note a test that takes longer than what isn't `slow` may."""
    begin = sum(os.times()[:4])
    try:
        return (yield)
    finally:
        spent = sum(os.times()[:4]) - begin
        if spent > BOUND and item.get_closest_marker("slow") is None:
            item.user_properties.append(("processor time", spent))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List the tests that should be `slow`, or shorter."""
    reports = [report for group in ("passed", "failed") for report in terminalreporter.getreports(group)]
    spent = [(dict(report.user_properties).get("processor time", 0.0), report.nodeid) for report in reports]
    long = sorted((each for each in set(spent) if each[0]), reverse=True)
    if long:
        terminalreporter.section(f"over {BOUND:g} s, but not slow (or compiling for the first time)")
        for seconds, name in long:
            terminalreporter.write_line(f"{seconds:6.1f} s  {name}")
    if os.environ.get("FIVEAXIS_WRITE_SLOW"):
        names = {*MEASURED.read_text(encoding="utf-8").splitlines(), *(short(name) for _, name in long)}
        MEASURED.write_text("".join(f"{name}\n" for name in sorted(names)), encoding="utf-8")


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of the real inputs."""
    folder = SHARED / "data"
    if not folder.is_dir():
        pytest.skip("the real inputs (../shared/data) aren't beside this checkout")
    return folder


@pytest.fixture(scope="session")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of CAD files, as Open Cascade writes them."""
    folder, maker = tmp_path_factory.mktemp("parts"), Path(__file__).parent / "support/cad_parts.py"
    subprocess.run([sys.executable, str(maker), str(folder)], check=True, capture_output=True, timeout=300)
    return folder


@pytest.fixture(scope="session")
def hayashi() -> Machine:
    return load_machine("hayashi-640123")


@pytest.fixture(scope="session")
def trunnion() -> Machine:
    return load_machine("linuxcnc-xyzac-trt")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Open a browser of the module's own; what it shows is left to the next test."""
    opened = Browser(tmp_path_factory.mktemp("profile"))
    try:
        yield opened
    finally:
        try:
            opened.close()
        finally:
            opened.process.kill()


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a text to a file of a folder of its own: a program, by default."""

    def written(text: str, name: str = "part.nc") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return written


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures out of reports: drawing takes most of a short run, and other tests look at them."""
    for name in ("energy_bars", "limit_strips", "spending_lines", "axis_lines", "speed_lines", "power_lines"):
        monkeypatch.setattr(f"fiveaxis.show.report.page.{name}", lambda *_: "<svg></svg>")
    for name in ("path_valley", "draw_valley", "draw_location"):
        monkeypatch.setattr(f"fiveaxis.show.report.page.{name}", lambda *_, **__: "data:,")


def read_case(data: Path, name: str, diameter: float) -> Toolpath:
    rows = np.loadtxt(data / "cases" / name, delimiter=",", skiprows=1)
    return Toolpath.from_contacts(rows[:, :3], rows[:, 3:], Tool.ball(diameter), name=name)


@pytest.fixture(scope="session")
def vase(data: Path) -> Toolpath:
    return read_case(data, "vase_overhang.csv", 10.0)


@pytest.fixture(scope="session")
def dome(data: Path) -> Toolpath:
    return read_case(data, "dome_underside.csv", 6.0)
