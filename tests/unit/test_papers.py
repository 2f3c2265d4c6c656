"""The scripts of the papers reproduce what they say they do, and draw their figures."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import cutting_forces
import drilling
import form_shaping
import nc_programs
import numpy as np
import pytest
from showing import NO_MATPLOTLIB, Paper, Row, Table, draw
from support.patience import PATIENCE

ROOT = Path(__file__).parents[2]
SCRIPTS = ("cutting_forces", "drilling", "form_shaping", "milling", "nc_programs")
PAGE = ROOT / "docs/pages/research/papers.md"


@pytest.fixture(scope="module")
def papers() -> dict[str, Paper]:
    return {name: importlib.import_module(name).paper() for name in SCRIPTS}


def values(paper: Paper, title: str) -> dict[str, float]:
    """Ours, of the tables whose title begins so."""
    return {row.name: row.ours for t in paper.tables if t.title.startswith(title) for row in t.rows}


@pytest.mark.parametrize("name", SCRIPTS)
def test_tables_that_a_script_calls_reproduced_are_within_what_it_says(papers, name):
    held = [table for table in papers[name].tables if table.within is not None]
    assert held
    for table in held:
        assert table.worst <= table.within, table.title


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_figure_has_one_file_and_the_page_shows_it(papers, name, tmp_path):
    draw(papers[name], tmp_path)
    drawn = {path.name for path in tmp_path.iterdir()}
    assert {Path(file).stem for file in drawn} == set(papers[name].figures)
    page = PAGE.read_text(encoding="utf-8")
    for file in drawn:
        assert f"../pictures/papers/{file}" in page
        assert (PAGE.parents[1] / "pictures/papers" / file).stat().st_size <= 150_000


def test_without_matplotlib_the_tables_are_printed_and_one_line_says_what_to_install(tmp_path):
    code = (
        "import importlib.util, runpy, sys; found = importlib.util.find_spec;"
        "importlib.util.find_spec = lambda name: None if name == 'matplotlib' else found(name);"
        f"sys.argv = ['drilling.py', '--figures', {str(tmp_path / 'out')!r}];"
        f"runpy.run_path({str(ROOT / 'examples/papers/drilling.py')!r}, run_name='__main__')"
    )
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=ROOT / "examples/papers",
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
    )
    assert run.stdout.splitlines()[-1] == NO_MATPLOTLIB
    assert "Experiment I: mean error" in run.stdout
    assert not (tmp_path / "out").exists()


def test_a_table_shows_ours_printed_and_the_difference():
    table = Table("Powers", "W", (Row("one", 101.0, 100.0), Row("other", 5.0)), None, 1)
    assert table.lines()[0] == "Powers"
    assert table.lines()[2].split() == ["one", "101.0", "100.0", "+1.00", "%"]
    assert table.lines()[3].split() == ["other", "5.0"]


def test_the_page_includes_all_that_the_scripts_print(papers):
    spec = importlib.util.spec_from_file_location("docs_papers", ROOT / "docs/papers.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page, made = PAGE.read_text(encoding="utf-8"), module.pages()
    assert set(made) == set(SCRIPTS)
    for name, text in made.items():
        assert f"{{include}} ../_generated/{name}.md" in page
        rows = {line for line in text.splitlines() if line.startswith("|")}
        for table in papers[name].tables:
            assert {f"| {' | '.join(cells)} |" for cells in table.cells()} <= rows, table.title
        for one in papers[name].misprints:
            assert f"| {one.where} | {one.printed} | {one.ours} | {one.why} |" in rows
        assert all(f"- {missing}" in text for missing in papers[name].missing)


def test_the_form_shaping_misprint_is_the_sign_of_one_term():
    """By hand: X10 Y20 Z30, A-30, C50, with r_y = x sinθ + y cosφ cosθ ∓ z sinφ cosθ."""
    (one,) = form_shaping.misprints()
    a, c = np.radians([-30.0, 50.0])
    known, term = 10.0 * np.sin(c) + 20.0 * np.cos(a) * np.cos(c), 30.0 * np.sin(a) * np.cos(c)
    assert f"{known + term:.3f} mm" in one.printed
    assert f"{known - term:.3f} mm" in one.ours


def test_the_stand_in_saves_about_as_much_as_the_papers_case_study(papers):
    saved = values(papers["form_shaping"], "Case study")["saved in the feed drives"]
    assert 50.0 < saved < 80.0
    power = form_shaping.mean_powers()
    assert power["after"]["Z"] < 0.3 * power["before"]["Z"]
    assert power["after"]["A"] > power["before"]["A"]


def test_the_pocket_programs_predict_the_papers_table_2():
    """Zag is fitted, so only its agreement shows that the file's coefficients come from the tables."""
    fitted = nc_programs.fit_coefficients()
    for letter, (a, b) in fitted.items():
        drive = nc_programs.machine().axis(letter).drive
        assert (drive.a, drive.b) == pytest.approx((a, b), rel=1e-3)
    shares = {name: nc_programs.y_over_x(name) for name in nc_programs.STRATEGIES}
    assert shares == pytest.approx({"zag": 29.3, "zigzag": 19.6, "contour": 13.0}, abs=0.1)


def test_passes_steps_and_times_of_the_printed_program_are_the_tables(papers):
    first = {t.title: t.rows for t in papers["nc_programs"].tables}
    blocks = zip(first["Table 1: energy by block"], first["Table 1: time by block"], strict=True)
    cuts = [pair for pair in blocks if "N01" < pair[0].name < "N19"]
    assert len(cuts) == 17
    for energy, time in cuts:
        assert abs(energy.difference) < 5e-3
        # A pass of the table takes 0.06 s more than its length at the feed.
        assert abs(time.difference) < 5e-3


def test_a_move_too_short_for_its_feed_takes_what_physics_says():
    """2√(t_a D/v_f) = 0.093 s where the paper's formula gives 0.066 s, for 0.3 mm at F500, t_a 0.06 s."""
    time = 2.0 * np.sqrt(nc_programs.RAMP * 0.3 / nc_programs.FEED)
    assert nc_programs.ramp_time(0.3) == pytest.approx(time, rel=1e-6)
    assert time == pytest.approx(0.093, abs=5e-4)
    (one,) = (m for m in nc_programs.misprints() if m.where.startswith("Eq. (3)"))
    assert "0.066 s" in one.printed


def test_the_printed_retracts_are_the_approachs():
    assert pytest.approx(318.73, abs=0.01) == (6502.0 * 0.17 + 75.12) * 0.27
    assert pytest.approx(31.87, abs=0.01) == (6502.0 * 0.17 + 75.12) * 0.027


def test_equation_17_as_printed_counts_the_cuts_power_twice(papers):
    means = values(papers["milling"], "Mean of the absolute sum") | values(papers["milling"], "Mean power")
    assert means["R·v + M·ω at S"] == pytest.approx(means["R·v + M·ω at D"], rel=1e-9)
    doubled = means["Eq. (17) as printed: moment at S, velocity of D"]
    assert doubled == pytest.approx(2.0 * means["R·v + M·ω at S"], rel=0.01)
    shares = values(papers["milling"], "Share of the moment")
    assert list(shares.values()) == pytest.approx([100.0, 0.0, 50.0], abs=0.2)


def test_drilling_reproduces_the_papers_errors_and_names_what_contradicts_them(papers):
    first = values(papers["drilling"], "Experiment I: mean error")
    assert first["proposed"] == pytest.approx(1.13, abs=0.005)
    assert first["P3 = C0 P_c + C1, printed coefficients"] == pytest.approx(1.06, abs=0.005)
    second = values(papers["drilling"], "Experiment II: mean error")
    assert second["proposed"] == pytest.approx(1.02, abs=0.005)
    fits = drilling.fits()
    assert fits["P1 = C0 MRR + C1"] == pytest.approx([5.746, 1393.6], rel=1e-4)
    assert fits["P2 = k0 MRR + k1 n + k2"] == pytest.approx([3.926, 0.6173, 1194.0], rel=1e-4)
    assert fits["P3 = C0 P_c + C1"] == pytest.approx([1.4036, 1237.9], rel=1e-4)
    assert drilling.fitted_share() == pytest.approx(0.1283, abs=5e-5)
    assert pytest.approx(1821.4, abs=0.2) == 1.4036 * 415.6 + 1237.9


def test_leaning_changes_the_mean_force_and_not_the_mean_power(papers):
    power = values(papers["cutting_forces"], "Mean power")
    force = values(papers["cutting_forces"], "Mean force")
    upright, leaning = "ball, upright", "ball, lead -20, lean 10 deg"
    assert power[leaning] == pytest.approx(power[upright], rel=5e-3)
    assert force[leaning] < 0.0 < force[upright]
    assert cutting_forces.cuts()[leaning].tool_axes[2, 2] < 1.0


def test_every_script_is_run_by_the_command_that_it_names():
    for name in SCRIPTS:
        text = (ROOT / f"examples/papers/{name}.py").read_text(encoding="utf-8")
        assert re.search(rf"^ +python examples/papers/{name}\.py \[--figures FOLDER\]$", text, re.M)
        assert f"python examples/papers/{name}.py" in PAGE.read_text(encoding="utf-8")
