"""Objects in a notebook: tables in HTML without markup of others, frames with the numbers of the files."""

import json
import sys
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import MissingDependency
from fiveaxis.base.findings import Finding, Severity
from fiveaxis.base.notebook import MOST_ROWS
from fiveaxis.nc.motion_table import read_motion, write_motion
from fiveaxis.nc.source import load_source

NAME = "<script>alert('ring')</script> & co.csv"


@pytest.fixture(scope="module")
def path():
    turn = np.linspace(0.0, 2.0 * np.pi, 120)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(120, -0.2)])
    return fx.Toolpath.from_contacts(20.0 * normal, normal, fx.Tool.ball(8), feed_mm_min=800, name=NAME)


@pytest.fixture(scope="module")
def solution(path, hayashi):
    return fx.optimise(path, hayashi, tilt=(15, 75), effort="quick")


class Reader(HTMLParser):
    """Collects the tags and the cells of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.open: list[str] = []
        self.cells: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.open.append(tag)
        if tag in ("td", "th", "caption"):
            self.cells.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.cells[-1] += data


def test_a_notebook_shows_a_short_table_without_scripts(path, solution, hayashi):
    for thing in (hayashi, path, solution, solution.energy, solution.program().report):
        read = Reader(thing._repr_html_())
        assert read.tags <= {"table", "caption", "thead", "tbody", "tr", "th", "td"}
        assert read.cells[0] == repr(thing).strip("<>")
        assert len(thing._repr_html_()) < 10_000


def test_the_table_has_the_numbers_of_the_object(path, solution, hayashi):
    energy = Reader(solution.energy._repr_html_()).cells
    for letter, joules in solution.energy.by_axis.items():
        assert energy[energy.index(letter) + 1] == f"{joules:.1f}"
    programs = Reader(solution._repr_html_()).cells
    for name, spent in solution.baselines.items():
        row = programs.index(name)
        assert programs[row + 1 : row + 4] == [
            f"{spent.total:.1f}",
            f"{spent.time:.1f}",
            f"{solution.savings()[name]:.1%}",
        ]
    assert "800 mm/min" in Reader(path._repr_html_()).cells
    axes = Reader(hayashi._repr_html_()).cells
    assert axes[axes.index("A") + 2] == "-120…30 deg"


def test_names_and_messages_of_files_are_text(path, solution, hayashi):
    for thing in (path, solution, replace(hayashi, name="<b>mill</b>")):
        assert "<script" not in thing._repr_html_()
        assert "<b>" not in thing._repr_html_()
    worst = Finding(Severity.ERROR, "gouge", "<img src=x onerror=alert(1)>")
    assert "<img" not in fx.Report.of_findings([worst])._repr_html_()


def test_a_long_report_is_cut_and_says_so():
    findings = [Finding(Severity.ERROR, "gouge", f"fault {n}") for n in range(200)]
    cells = Reader(fx.Report.of_findings(findings)._repr_html_()).cells
    assert cells[-1] == f"… {200 - MOST_ROWS} more"


def test_the_frame_of_a_motion_has_the_columns_of_its_file(solution, hayashi, tmp_path):
    frame = solution.motion.to_frame()
    file = write_motion(solution.motion, tmp_path / "motion.csv", hayashi)
    table = np.loadtxt(file, delimiter=",", skiprows=1, usecols=range(8))
    names = ["X_mm", "Y_mm", "Z_mm", "A_deg", "C_deg", "feed_mm_min", "time_s", "line"]
    assert list(frame.columns[:9]) == [*names, "kind"]
    np.testing.assert_allclose(frame[names].to_numpy(), table, rtol=0.0, atol=5e-10)
    assert frame["feed_mm_min"].to_numpy() == pytest.approx(800.0)
    assert set(frame["kind"]) == {"cut"}
    read = read_motion(load_source(file), hayashi)
    assert list(read.to_frame().columns) == list(frame.columns)


def test_the_frame_of_a_program_has_every_move_with_its_phase(solution):
    made = solution.program()
    frame = made.motion.to_frame()
    assert len(frame) == len(made.motion)
    assert frame["time_s"].sum() == pytest.approx(float(made.motion.motion.time.sum()))
    assert list(dict.fromkeys(frame["phase"])) == ["approach", "lead-in", "path", "lead-out"]
    assert set(frame.loc[frame["phase"] == "approach", "kind"]) == {"rapid"}
    assert set(frame.loc[frame["phase"] == "path", "kind"]) == {"cut"}


def test_the_frame_of_a_path_has_its_contacts_and_their_places(path):
    frame = path.to_frame()
    np.testing.assert_array_equal(frame[["contact_x_mm", "contact_y_mm", "contact_z_mm"]], path.contact)
    np.testing.assert_array_equal(frame[["normal_x", "normal_y", "normal_z"]], path.normal)
    assert frame["axis_z"].isna().all()
    assert frame["length_mm"].sum() == pytest.approx(float(path.lengths.sum()))
    assert list(frame.loc[3, ["location", "file", "line", "kind"]]) == [3, NAME, 4, "cut"]
    tips = fx.Toolpath.from_tips([[0, 0, 1], [5, 0, 1]], [[0, 0, 1]] * 2, fx.Tool.ball(8)).to_frame()
    np.testing.assert_allclose(tips[["tip_x_mm", "tip_y_mm", "tip_z_mm"]], [[0, 0, 1], [5, 0, 1]])


def test_columns_need_no_library_and_are_plain_data(path):
    plain = json.loads(json.dumps(path.as_lists()))
    assert plain["axis_x"] == [None] * len(path)
    assert plain["contact_x_mm"] == path.contact[:, 0].tolist()


def test_without_pandas_the_error_says_what_to_install(path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingDependency, match=r"pip install 'fiveaxis\[notebook\]'"):
        path.to_frame()
