"""The page: one file, the same each time, and nothing in it from elsewhere."""

import re
import subprocess
import threading
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import trimesh
from support.quick_optimiser import tilt_bounds

from fiveaxis.base import Workpiece
from fiveaxis.base.errors import SettingError
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import Surroundings
from fiveaxis.model import Body, MeshShape, Tool, Toolpath, follow, motion_energy
from fiveaxis.posture.solution import Baseline, Optimum
from fiveaxis.show import write_preview
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside

LARGEST = 15e6  # byte, for 100 000 locations, or 2 000 with a stock that they cut


class Tags(HTMLParser):
    """Every tag with its attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


@pytest.fixture(scope="module")
def page(solution, part) -> str:
    return render_page(solution, Beside(part=part))


def test_no_tag_fetches_anything(page):
    for tag, attributes in Tags(page).found:
        assert tag not in {"link", "iframe", "img", "base", "object", "embed"}
        assert not {"src", "href", "srcset"} & set(attributes), (tag, attributes)


def test_the_page_forbids_the_browser_to_fetch_anything(page):
    policies = [a["content"] for t, a in Tags(page).found if a.get("http-equiv") == "Content-Security-Policy"]
    assert len(policies) == 1
    assert policies[0].startswith("default-src 'none'")
    assert "http" not in policies[0]


def test_no_server_process_and_no_thread_is_left(solution, part, monkeypatch):
    def refuse(*args, **kwargs):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    before = threading.active_count()
    render_page(solution, Beside(part=part))
    assert threading.active_count() == before


def test_names_are_escaped_and_without_their_folder(page):
    assert "&lt;ring&gt; &amp; co.csv" in page
    assert "<ring>" not in page
    assert "/some/folder" not in page


def test_findings_are_listed_with_their_file_but_not_its_folder(solution):
    finding = Finding(Severity.WARNING, "feed-over", "too quick", Place(7, 12, "/some/folder/a.nc"))
    page = render_page(solution, Beside(findings=[finding]))
    entry = re.search(r'<button type="button" class="warning" data-row="([0-9]+)">([^<]*)</button>', page)
    assert entry is not None
    assert int(entry[1]) == 7
    assert entry[2] == "warning: feed-over (1): too quick, at a.nc:12, location 7 [feed-over]"
    assert "/some/folder" not in page


def test_a_finding_of_the_whole_path_is_listed_and_has_no_mark(solution):
    findings = [Finding(Severity.NOTE, "no-engagement", "not known")]
    page = render_page(solution, Beside(findings=findings))
    assert (
        '<button type="button" class="note">note: no-engagement (1): not known [no-engagement]</button>'
        in page
    )
    assert 'data-node="workpiece/marks"' not in page


def test_findings_of_one_cause_are_one_entry_that_leads_to_the_worst(solution):
    findings = [Finding(Severity.WARNING, "feed-over", f"no {i}", Place(i), i % 7) for i in range(150)]
    page = render_page(solution, Beside(findings=findings))
    (entry,) = re.findall(r'<button type="button" class="warning" data-row="([0-9]+)">([^<]*)<', page)
    assert int(entry[0]) == 6
    assert entry[1].startswith("warning: feed-over (150): no 6, worst at location 6; first at location 0")
    assert "<summary>findings: 150</summary>" in page


def test_the_legend_says_what_both_postures_cost(page, solution):
    legend = re.search(r'<section id="legend".*?</section>', page, re.DOTALL)
    assert legend is not None
    assert f"{solution.energy.total:,.0f} J" in legend[0]
    assert f"normal {solution.compared['normal'].energy.total:,.0f} J" in legend[0]
    assert " W and more" in legend[0]
    for energy in (solution.energy, solution.baselines["normal"]):
        starts, reversals = (sum(n.values()) for n in (energy.steadiness.starts, energy.steadiness.reversals))
        assert f"{energy.time:,.1f} s; starts {starts}, reversals {reversals}" in legend[0]
    assert "</span> start, " in legend[0]


def test_the_time_line_has_a_row_for_each_axis(page):
    letters = re.search(r'<div id="axes" aria-hidden="true">(.*?)</div>', page)
    assert letters is not None
    assert re.findall("<span>(.)</span>", letters[1]) == list("XYZAC")
    assert 'id="timeline" style="height: 124px"' in page


def test_without_part_and_baseline_there_are_no_boxes_for_them(solution):
    found = Tags(render_page(replace(solution, compared={}))).found
    boxes = [a["data-node"] for t, a in found if t == "input" and "data-node" in a]
    assert boxes == ["workpiece/path", "links", "tool"]
    assert "beside" not in {a.get("id") for _, a in found}


@pytest.mark.slow
def test_a_hundred_thousand_locations_stay_below_the_largest_page(solution, tmp_path):
    fine = trimesh.creation.icosphere(subdivisions=7, radius=80.0)
    trimesh.creation.icosphere(subdivisions=5, radius=300.0).export(tmp_path / "body.stl")
    bodies = tuple(Body(link, MeshShape(tmp_path / "body.stl")) for link in ("C", "A", "bed", "Z", "Z"))
    long = dome_solution(replace(solution.machine, bodies=bodies), 100_000)
    findings = [Finding(Severity.WARNING, "feed-over", f"finding {i}", Place(i)) for i in range(2000)]
    page = render_page(long, Beside(surroundings=Surroundings(part=fine, stock=fine), findings=findings))
    assert LARGEST / 4 < len(page.encode()) < LARGEST


@pytest.mark.slow
def test_two_thousand_rough_moves_with_their_stock_stay_below_the_largest_page(solution):
    part = trimesh.creation.icosphere(subdivisions=5, radius=80.0)
    around = Surroundings.of(Workpiece(part=part, stock="part+0.5", stock_resolution=0.5))
    page = render_page(dome_solution(solution.machine, 2_000), Beside(surroundings=around))
    assert len(page.encode()) < LARGEST


def dome_solution(machine, n: int) -> Optimum:
    """A rough spiral down a dome, two postures: no two moves are alike."""
    rng = np.random.default_rng(1)
    down, round_ = np.linspace(0.3, 1.4, n), np.linspace(0.0, 400.0 * np.pi, n)
    normal = np.stack([np.sin(down) * np.cos(round_), np.sin(down) * np.sin(round_), np.cos(down)], axis=1)
    contact = 80.0 * normal + rng.normal(scale=0.01, size=(n, 3))
    path = Toolpath.from_contacts(contact, normal, Tool.ball(10.0))
    found = {}
    for name, tilt in (("result", 0.5), ("normal", 0.9)):
        angles = np.stack([tilt + 0.1 * np.sin(round_), round_ / 9.0], axis=1)
        motion = follow(path, machine, angles + rng.normal(scale=0.001, size=(n, 2)))
        found[name] = Baseline(motion, motion_energy(machine, motion))
    result = found.pop("result")
    tilt = tilt_bounds(path, tilt=(15, 75))
    return Optimum(machine, path, tilt, result.motion, result.energy, found, missing={}, stages=())


def test_a_path_that_cannot_be_written_is_an_error(solution, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SettingError, match="can't be written"):
        write_preview(solution, tmp_path / "file" / "page.html")
