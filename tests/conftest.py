"""What several tests share: the real inputs and the machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from hypothesis import HealthCheck, settings

from fiveaxis.machine import Machine, load_machine
from fiveaxis.toolpath import Tool, Toolpath

# The same examples every time. How long they take to draw is no property of the code, as machines are shared.
# What a test writes to its own folder for one example, it overwrites for the next.
settings.register_profile(
    "same",
    derandomize=True,
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("same")

SHARED = Path(__file__).parents[2] / "shared"
# Rooms of `unit` whose tests compile hardly anything.
UNCOMPILED = {"energy", "kinematics", "machine", "nc", "toolpath"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put rooms that compile nothing after the laws: of two processes each begins with one of them.

    In a fresh checkout both would compile the optimiser's loops at the same time.
    """

    def turn(item: pytest.Item) -> int:
        parts = set(item.path.parts)
        return 0 if "unit" not in parts else 1 if UNCOMPILED & parts else 2

    items.sort(key=turn)


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of the real inputs."""
    folder = SHARED / "data"
    if not folder.is_dir():
        pytest.skip("the real inputs (../shared/data) aren't beside this checkout")
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
        monkeypatch.setattr(f"fiveaxis.report.page.{name}", lambda *_: "<svg></svg>")
    for name in ("path_valley", "draw_valley", "draw_location"):
        monkeypatch.setattr(f"fiveaxis.report.page.{name}", lambda *_, **__: "data:,")


def read_case(data: Path, name: str, diameter: float) -> Toolpath:
    rows = np.loadtxt(data / "cases" / name, delimiter=",", skiprows=1)
    return Toolpath.from_contacts(rows[:, :3], rows[:, 3:], Tool.ball(diameter), name=name)


@pytest.fixture(scope="session")
def vase(data: Path) -> Toolpath:
    return read_case(data, "vase_overhang.csv", 10.0)


@pytest.fixture(scope="session")
def dome(data: Path) -> Toolpath:
    return read_case(data, "dome_underside.csv", 6.0)
