"""Paths and figures that others published, and what is computed of them beside it."""

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import fiveaxis as fx

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
# Words of three digits are summed over thousands of rows.
ROUNDING = 0.1
# What the three layers take at most at the authors' largest lean, deg.
MOST = {"simple_curve_10": 596.0, "simple_curve_8": 186.0, "model_1_10": 1800.0}


@pytest.fixture(scope="module")
def published(data: Path) -> ModuleType:
    """The benchmark, where its paths are."""
    if not (data / "published").is_dir():
        pytest.skip("published paths (../shared/data/published) aren't beside this checkout")
    sys.path.insert(0, str(BENCHMARKS))
    try:
        spec = importlib.util.spec_from_file_location("published", BENCHMARKS / "published.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules["published"] = module  # dataclasses look their module up
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(BENCHMARKS))
    return module


@pytest.mark.parametrize("name", MOST)
def test_the_authors_postures_travel_and_lean_as_they_were_measured_elsewhere(published, name):
    path, machine = published.layer(name)
    expected = json.loads((published.FOLDER / "expected_zhang.json").read_text(encoding="utf-8"))
    said = expected[f"zhang_{name}"]
    theirs = published.authors(name, path)
    assert theirs.degrees == pytest.approx(said["authors_travel_deg"], abs=ROUNDING)
    assert theirs.median == pytest.approx(said["authors_lean_deg"]["median"], abs=1e-3)
    assert theirs.largest == pytest.approx(said["authors_lean_deg"]["max"], abs=1e-3)
    # Their table turns the part: the tool turns the other way relative to it.
    angles = np.radians(
        np.loadtxt(published.FOLDER / f"zhang_{name}_authors.csv", delimiter=",", skiprows=1)[:50]
    )
    positions = np.zeros((len(angles), 5))
    positions[:, machine.rotary_columns] = -angles[:, ::-1] if machine.rotaries[0] == "C" else -angles
    lean = published.leans(machine.forward(positions)[1], path.at(np.arange(len(angles))))
    assert lean[2] <= theirs.largest + 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.release] * (n != "simple_curve_10")) for n in MOST]
)
def test_layers_take_less_travel_than_greedy_at_the_same_largest_lean(published, name):
    path, _ = published.layer(name)
    found = published.searched(name, published.LAYERS[name], "quick")
    best = published.ours(found, path)
    assert best.degrees <= min(MOST[name], published.baselines(found)["greedy"].degrees)
    assert best.largest <= published.LAYERS[name] + 1e-6
    assert best.off < 1e-9


@pytest.mark.slow
def test_more_effort_never_takes_longer(published):
    path, machine = published.made(published.curves()["IJMS 2021"])
    quick, normal = (
        fx.optimise(path, machine, cone=2.0, objective="time", effort=e) for e in ("quick", "normal")
    )
    assert normal.energy.time <= quick.energy.time * (1.0 + 1e-9)


def test_an_axis_takes_at_least_the_time_of_its_trapezoid(published):
    _, machine = published.made(published.curves()["JCDE 2022"])
    axis = machine.axis("X")
    # 100 mm/s and 500 mm/s²: 0.2 s and 10 mm to speed up, and as much to slow down.
    assert published.least_time(120.0, axis) == pytest.approx(1.4)
    assert published.least_time(5.0, axis) == pytest.approx(0.2)
