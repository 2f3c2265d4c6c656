"""The numbered examples are short, run without a warning and print what they promise."""

import ast
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from support.patience import PATIENCE

from fiveaxis.job import read_job, run_job
from fiveaxis.show.report.page import compose_page

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("0*.py"))
LONGEST = 100  # lines
PERCENT = re.compile(r"([+-]\d+\.\d) ?%")


@pytest.fixture
def said(capsys):
    """Give what runs an example and returns the lines that it printed."""

    def run(name: str) -> list[str]:
        (path,) = (p for p in EXAMPLES if p.name.startswith(name))
        runpy.run_path(str(path), run_name="__main__")
        return capsys.readouterr().out.splitlines()

    return run


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_begins_with_its_objective(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST
    assert text.startswith('"""')


def test_a_machine_from_a_code_has_two_branches_that_close_and_c_turns_most_near_its_direction(said):
    lines = said("01")
    assert sum(line.startswith("branch") and line.endswith("closes True") for line in lines) == 2
    turns = [float(line.split()[-2]) for line in lines[-3:]]
    assert turns == sorted(turns)


def test_the_power_surface_has_its_cheapest_posture_below_its_dearest(said):
    lines = said("02")
    assert [line.split()[0] for line in lines[3:5]] == ["cheapest:", "dearest:"]
    assert lines[3].split()[1:] != lines[4].split()[1:]


def test_a_path_point_by_point_is_optimised_and_verified(said):
    lines = said("03")
    assert all(float(line.split()[-1].rstrip("%")) > 0.0 for line in lines if line.startswith("saved"))
    assert lines[-1].startswith("verified: True")


def test_programs_of_three_controls_are_verified_from_their_text(said):
    lines = said("05")
    assert [line.split(":")[0] for line in lines] == ["linuxcnc", "sinumerik", "heidenhain"]
    assert all("verified True" in line for line in lines)


def test_passes_on_a_mesh_beside_a_clamp_are_planned_kept_clear_and_verified(said):
    blind, clear = said("04")[1:]
    assert blind.startswith("blind:")
    assert "holder-collision" in blind
    assert clear.startswith("clear:")
    assert "verified True" in clear


def test_the_cells_of_the_notebook_print_and_show_what_they_name(capsys):
    formatter = pytest.importorskip("IPython.core.formatters").DisplayFormatter()
    _, *cells = (ROOT / "examples/07_notebook.py").read_text(encoding="utf-8").split("\n# %%")
    names: dict[str, object] = {}
    shown = []
    for cell in cells:
        *lines, last = ast.parse(f"# %%{cell}").body
        exec(compile(ast.Module(lines, []), "cell", "exec"), names)
        if isinstance(last, ast.Expr) and isinstance(last.value, ast.Name):
            shown.append(formatter.format(names[last.value.id])[0])
        else:
            exec(compile(ast.Module([last], []), "cell", "exec"), names)
    names["view"].close()
    machine, solution, surface, valley, view = shown
    assert "<table>" in machine["text/html"]
    assert "lead-lean" in solution["text/html"]
    assert all("<svg" in one["image/svg+xml"] for one in (surface, valley))
    assert 'sandbox="allow-scripts"' in view["text/html"]
    said = capsys.readouterr().out.splitlines()
    assert said[0].split()[0] == "X_mm"
    assert [line.split()[0] for line in said[2:6]] == ["approach", "lead-in", "path", "lead-out"]
    lowest = {line.split(":")[0]: float(line.split()[1]) for line in said if "axes' zero" in line}
    assert set(lowest) == {"optimised", "normal", "lead-lean", "greedy"}


@pytest.mark.slow
@pytest.mark.parametrize(("job", "verdict"), [("job", "partial"), ("complete", "safe")])
def test_the_jobs_have_the_verdict_that_their_descriptions_deserve(job, verdict):
    outcome = run_job(read_job(ROOT / f"examples/overhang/{job}.toml"))
    answers, report = outcome.report.answers, outcome.report.verdict
    assert answers.verdict == verdict
    assert f'class="answer verdict {verdict}"' in compose_page(outcome.report)
    risks = [detail.text for detail in answers.safe.details if detail.about == "Risk"]
    assert len(risks) <= 5
    assert bool(risks) is bool(report.risks) is (verdict == "partial")
    assert all(" add " in text or text.endswith("nothing settles it.") for text in risks)
    assert report.ok
    assert report.passed


@pytest.mark.slow
def test_a_batch_of_two_jobs_runs_and_then_finds_its_results():
    lines = ran(ROOT / "examples/06_batch.py", "1").splitlines()
    assert lines[:2] == ["first time: 2 jobs, 0 done before", "second time: 2 jobs, 2 done before"]
    assert all(": fine, " in line for line in lines[2:])


@pytest.mark.slow
def test_the_public_mill_is_fitted_to_one_run_and_gives_the_others_as_the_page_says(data, tmp_path):
    lines = ran(ROOT / "examples/calibration/umich.py", str(data / "power"), str(tmp_path)).splitlines()
    page = (ROOT / "docs/pages/research/results.md").read_text(encoding="utf-8")
    rows = {
        cells[1].strip(): cells
        for cells in (line.split("|") for line in page.splitlines())
        if len(cells) == 6
    }
    for axis in ("X", "Y"):
        (start,) = (i for i, line in enumerate(lines) if line.startswith(f"{axis}: "))
        (together,) = (line for line in lines[start : start + 10] if "held out together" in line)
        (first,) = (line for line in lines[start : start + 16] if "fitted to umich_experiment_01" in line)
        steady, whole = PERCENT.findall(together)
        assert all(abs(float(error)) < 5.0 for error in (steady, whole))
        assert rows[axis][2].split()[0] == steady
        assert rows[axis][3].split()[0] == whole
        assert PERCENT.findall(rows[axis][4]) == PERCENT.findall(first)[:2]
    assert {path.name for path in tmp_path.iterdir()} == {"umich-x.svg", "umich-y.svg"}


def ran(script: Path, *arguments: str) -> str:
    """Run a script in a process of its own in which warnings are errors."""
    command = [sys.executable, "-W", "error", str(script), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=PATIENCE).stdout
