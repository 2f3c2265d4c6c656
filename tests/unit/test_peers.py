"""The open benchmark: its case files, its checker, its runner; the checker finds what is planted."""

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

PEERS = Path(__file__).parents[1] / "benchmarks" / "peers"
MODULES = ("paths", "case", "checker", "chain", "tesseract", "methods", "running", "comparison")


@pytest.fixture(scope="module")
def peers() -> Iterator[SimpleNamespace]:
    """The benchmark's modules, which stand beside each other in a folder of their own."""
    folders = [str(PEERS), str(PEERS.parent)]
    sys.path[:0] = folders
    known = {name: sys.modules.pop(name) for name in MODULES if name in sys.modules}
    try:
        yield SimpleNamespace(**{name: importlib.import_module(name) for name in MODULES})
    finally:
        for folder in folders:
            sys.path.remove(folder)
        for name in MODULES:
            sys.modules.pop(name, None)
        sys.modules.update(known)


@pytest.fixture(scope="module")
def arc(peers):
    return peers.case.Case.read("arc")


@pytest.fixture(scope="module")
def leaned(peers, arc):
    """Axis values of the constant lead and lean on the short case."""
    return peers.methods.axis_values(arc, peers.methods.METHODS["lead and lean"](arc))


def test_every_case_can_be_read(peers, data):
    for name in peers.case.case_names():
        case = peers.case.Case.read(name)
        assert len(case.toolpath) >= 60
        assert case.options.keys() & {"tilt", "cone"}


def test_an_unknown_key_is_refused(peers, tmp_path, monkeypatch):
    monkeypatch.setattr(peers.case, "FOLDER", tmp_path)
    (tmp_path / "odd.toml").write_text('path = "arc"\ntilt = [15, 75]\nfeed = 3\n')
    with pytest.raises(ValueError, match="unknown feed"):
        peers.case.Case.read("odd")


def test_a_holder_in_the_part_is_found_and_the_same_tool_beside_it_is_clear(peers):
    case = peers.case.Case.read("clamp")
    values = peers.methods.axis_values(case, peers.methods.METHODS["normal"](case))
    # Along the normal of the upright walls, leaned by 15 deg, the holder of 40 mm is in clamp or block.
    assert peers.checker.violations(case, values)["holder"] > 100
    away = values.copy()
    away[:, case.machine.column("Z")] += 200.0
    assert "holder" not in peers.checker.violations(case, away)


def test_what_keeps_the_bounds_breaks_nothing(peers, arc, leaned):
    assert peers.checker.violations(arc, leaned) == {}


@pytest.mark.parametrize(
    ("column", "by", "what"), [("X", 0.01, "off the path"), ("C", np.pi, "off the path")]
)
def test_the_checker_finds_an_axis_that_is_off(peers, arc, leaned, column, by, what):
    off = leaned.copy()
    off[7, arc.machine.letters.index(column)] += by
    assert peers.checker.violations(arc, off)[what] == 1


def test_the_checker_finds_leans_turns_and_limits(peers, arc):
    from fiveaxis.model import follow

    problem = arc.problem
    along = np.tile([-np.pi / 2.0, 0.0], (len(arc.toolpath), 1))
    _, excess = problem.placed(slice(None), along)
    found = peers.checker.violations(arc, follow(arc.toolpath, arc.machine, along).positions)
    assert found.get("lean", 0) == int((excess > 0.0).sum()) > 0
    hopping = along.copy()
    hopping[30:, arc.machine.rotary_columns.index(arc.machine.column("C"))] += np.pi
    far = along.copy()
    far[:3, arc.machine.rotary_columns.index(arc.machine.column("A"))] = 1.0
    for rotary, what, count in ((hopping, "turn", 1), (far, "limits", 3)):
        positions = follow(arc.toolpath, arc.machine, rotary).positions
        assert peers.checker.violations(arc, positions)[what] == count


def test_the_lattice_keeps_the_bounds_and_is_cheaper_than_the_normal(peers, arc):
    cost = {}
    for method in ("lattice", "normal"):
        positions = peers.methods.axis_values(arc, peers.methods.METHODS[method](arc))
        assert peers.checker.violations(arc, positions) == {}
        cost[method] = arc.problem.cost(positions)
    assert cost["lattice"] < cost["normal"]


def test_a_method_says_why_it_cannot_do_a_case(peers, arc, monkeypatch):
    monkeypatch.setattr(peers.methods, "SHORT", 10)
    with pytest.raises(peers.methods.CannotDoError, match="more than 10 locations"):
        peers.methods.annealing(arc)


def test_the_scripts_chain_is_the_machines(peers, arc):
    """Axis values and tool directions that peers compute without the package, and their derivatives."""
    problem = peers.tesseract.described(arc)
    chain = peers.chain.Chain(problem["joints"], problem["centre"])
    rotary, points = np.array(problem["starts"][0]), np.array(problem["points"])
    values, axis = chain.values(rotary, points)
    order = [arc.machine.column(joint.letter) for joint in arc.machine.chain.joints]
    positions = peers.methods.axis_values(arc, (arc.toolpath, rotary))
    np.testing.assert_allclose(values, positions[:, order], atol=1e-9)
    np.testing.assert_allclose(axis, peers.checker.tool_frames(arc, positions)[1], atol=1e-12)
    by_values, by_axis = chain.derivatives(rotary, points)
    small = np.array([3e-4, -2e-4])
    further, turned = chain.values(rotary + small, points)
    np.testing.assert_allclose(further - values, by_values @ small, atol=1e-4)
    np.testing.assert_allclose(turned - axis, by_axis @ small, atol=1e-6)


def test_why_a_peer_failed_is_not_hidden_by_its_wheels_report_of_leaks(peers):
    said = "no sample keeps the lean\nnanobind: leaked 3 types!\n - leaked type 'x'\n"
    assert peers.tesseract.reason(said) == "no sample keeps the lean"
    assert peers.tesseract.reason("") == "it ended without a word"
    assert "C++ library" in peers.tesseract.reason("ImportError: version `GLIBCXX_3.4.31' not found")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["TrajOpt", "Descartes"])
def test_tesseracts_planners_keep_the_bounds_and_are_cheaper_than_their_start(
    peers, arc, leaned, monkeypatch, method
):
    folder = peers.tesseract.environments()
    if not any(folder.glob("tesseract*")):
        pytest.skip("the wheel's environment isn't made")
    monkeypatch.setattr(peers.methods, "SECONDS", 20.0)
    try:
        positions = peers.methods.axis_values(arc, peers.methods.METHODS[method](arc))
    except peers.methods.CannotDoError as error:
        if "newer C++ library" in str(error):
            pytest.skip(str(error))
        raise
    assert peers.checker.violations(arc, positions) == {}
    assert arc.problem.cost(positions) < 0.5 * arc.problem.cost(leaned)


def test_a_run_has_every_figure_and_is_not_repeated(peers, tmp_path):
    result = peers.comparison.result_of(tmp_path, "arc", "normal", 300.0, again=False)
    assert result["energy"] > result["travel"] > 0.0
    assert result["memory"] > 0.0
    assert result["violations"] == {}
    [file] = tmp_path.iterdir()
    file.write_text(json.dumps(result | {"energy": 1.0}))
    assert peers.comparison.result_of(tmp_path, "arc", "normal", 300.0, again=False)["energy"] == 1.0


def test_each_figure_has_a_table_of_methods_by_cases_with_a_star_where_a_bound_is_broken(peers):
    done = {"energy": 5e3, "travel": 10.0, "time": 1.0, "processor": 0.5, "memory": 7.0, "locations": 60}
    results = [
        {"case": "arc", "method": "one", "why": "needs two"},
        {"case": "arc", "method": "two", **done, "violations": {"turn": 3}},
        {"case": "arc", "method": "three", **done, "energy": 4e3, "violations": {}},
        {"case": "wall", "method": "three", **done, "violations": {}},
    ]
    lines = peers.comparison.table_of(results).splitlines()
    rows = [line for line in lines if line.startswith("| t")]
    assert rows == [
        "| two | 5 000* |  |",
        "| three | 4 000 | 5 000 |",
        "| two | 10* |  |",
        "| three | 10 | 10 |",
    ]
    assert "- **arc**, 60 locations; one: needs two; two breaks turn at 3." in lines
