"""The comparison of results with those on record: a dearer result fails, a slower one is only told."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture(scope="module")
def regression() -> ModuleType:
    sys.path.insert(0, str(BENCHMARKS))
    try:
        spec = importlib.util.spec_from_file_location("regression", BENCHMARKS / "regression.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules["regression"] = module  # dataclasses look their module up
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(BENCHMARKS))
    return module


@pytest.mark.parametrize(
    ("cost", "ratio", "fails", "word"),
    [
        (100.0, 5.0, False, "as on record"),
        (100.09, 5.0, False, "as on record"),
        (100.11, 5.0, True, "DEARER than 100.0 J"),
        (99.0, 5.0, False, "cheaper"),
        (100.0, 50.0, False, "slower, 10.0 times"),
    ],
)
def test_only_a_dearer_result_fails(
    regression: ModuleType, cost: float, ratio: float, fails: bool, word: str
) -> None:
    record = {"case, energy": regression.Row(100.0, 10, 5.0)}
    judged = regression.judge({"case, energy": regression.Row(cost, 10, ratio)}, record)
    assert bool(judged.dearer) is fails
    assert word in judged.text[0]


def test_a_result_without_a_record_is_told(regression: ModuleType) -> None:
    judged = regression.judge({"new, energy": regression.Row(1.0, 1, 1.0)}, {})
    assert not judged.dearer
    assert "not on record" in judged.text[0]


def test_the_record_holds_the_quick_cases(regression: ModuleType) -> None:
    names = {f"{name}, {word}" for name, words in regression.QUICK.items() for word in words}
    record = regression.read_record()
    assert names <= set(record)
    assert all(row.cost > 0.0 and row.ratio > 0.0 for row in record.values())
