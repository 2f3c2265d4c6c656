"""The finished part: planted gouges and ridges are found with place and block, and nothing else is."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.unverified_text import write_text

import fiveaxis as fx
from fiveaxis.base.errors import SettingError
from fiveaxis.model import Tool, Toolpath, follow
from fiveaxis.model.toolpath import shapes
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.show import write_finished

RADIUS, SIDE, TOP = 3.0, 12.0, 4.0
PITCH = 0.2


@pytest.fixture(scope="module")
def part() -> trimesh.Trimesh:
    mesh = trimesh.creation.box(extents=(SIDE, SIDE, TOP))
    mesh.apply_translation((0.0, 0.0, TOP / 2.0))
    return mesh


def face(step: float = 0.5) -> np.ndarray:
    """Tips of passes to and fro over the top of the part."""
    rows = []
    for i, y in enumerate(np.arange(-SIDE / 2.0 - 2.0, SIDE / 2.0 + 2.0, step)):
        x = np.linspace(-8.0, 8.0, 9) * (-1.0) ** i
        rows += [(a, y, TOP) for a in x]
    return np.array(rows)


def check(
    tips: np.ndarray,
    part,
    hayashi,
    folder: Path,
    tool: Tool | None = None,
    stock: str = "part+1",
    rapids: int = 0,
    **given,
):
    """Write a program of tips with the tool upright, and verify it with a stock."""
    tool = tool or Tool.ball(2.0 * RADIUS)
    path = Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (len(tips), 1)), tool)
    path = path.with_rapids(np.arange(len(path)) >= len(path) - rapids)
    motion = follow(path, hayashi, np.zeros((len(path), 2)))
    file = write_text(motion, folder / "face.ngc", machine=hayashi)
    return fx.verify_program(
        file, hayashi, tool=path.tool, part=part, stock=stock, stock_resolution=PITCH, **given
    )


def test_a_clean_program_has_no_finding_and_its_figures_are_told(part, hayashi, tmp_path):
    report = check(face(), part, hayashi, tmp_path)
    assert set(report.counts) <= {"approach-unknown"}
    assert report.figures["stock_gouge_mm"] < 0.01
    assert report.figures["left_over_mm"] == 0.0
    whole = 2.0 * SIDE * SIDE + 4.0 * SIDE * TOP
    assert report.figures["finished_share"] == pytest.approx(SIDE * SIDE / whole, rel=0.05)
    assert any("cut along all moves" in sentence for sentence in report.passed)
    assert report.cut is not None
    assert report.cut.removal.volume.sum(axis=1).mean() == pytest.approx(SIDE * SIDE, rel=0.5)


@pytest.mark.parametrize("depth", [0.06, 0.1, 0.3, 1.0])
def test_a_planted_gouge_is_found_with_its_depth_its_place_and_its_block(depth, part, hayashi, tmp_path):
    tips = face()
    at = int(np.argmin(np.linalg.norm(tips[:, :2] - [2.0, 1.0], axis=1)))
    tips[at, 2] -= depth
    report = check(tips, part, hayashi, tmp_path)
    cut = [f for f in report.findings if f.code == "gouge" and "finished part lacks" in f.message]
    assert cut
    worst = max(cut, key=lambda finding: finding.value)
    # Between two rays the deepest point reads high by their distance times its slope.
    assert worst.value == pytest.approx(depth, rel=0.05, abs=0.01)
    words = worst.message.split()
    place = np.array([float(words[words.index(letter) + 1].rstrip(",")) for letter in "XYZ"])
    assert np.linalg.norm(place[:2] - tips[at, :2]) < 1.0
    exact = {f.place.line for f in report.findings if f.code == "gouge" and "reaches" in f.message}
    assert worst.place.line in exact


def test_a_lost_pass_leaves_a_ridge(part, hayashi, tmp_path):
    tips = face()
    lost = np.isclose(tips[:, 1], 0.5) | np.isclose(tips[:, 1], 0.0)
    report = check(tips[~lost], part, hayashi, tmp_path)
    assert report.ok
    ridge, slope = RADIUS - np.sqrt(RADIUS**2 - 0.75**2), 0.75 / RADIUS
    assert ridge - slope * PITCH / 2.0 < report.figures["left_over_mm"] < ridge + 0.01
    (first, *_) = [f for f in report.findings if f.code == "left-over"]
    assert "between finished places" in first.message


def test_the_stocks_tolerance_says_what_is_finished_in_check_and_map(part, hayashi, tmp_path):
    coarse = face(1.414)  # leaves ridges of 0.084 mm
    usual = check(coarse, part, hayashi, tmp_path)
    wide = check(coarse, part, hayashi, tmp_path, stock_tolerance=0.2)
    assert "left-over" in usual.counts
    assert "left-over" not in wide.counts
    assert wide.figures["finished_share"] > 1.1 * usual.figures["finished_share"]
    page = write_finished(wide.cut, tmp_path / "map.html", "Map").read_text(encoding="utf-8")
    assert "(±0.20 mm)" in page
    assert "dark from 0.8 mm" in page
    with pytest.raises(SettingError, match="stock_tolerance = 0 mm is out of range"):
        check(coarse, part, hayashi, tmp_path, stock_tolerance=0.0)


def test_a_plate_that_is_cut_away_whole_is_a_gouge(part, hayashi, tmp_path):
    """No ray has an end left to measure in a plate of which nothing is left."""
    plate = trimesh.creation.box(extents=(4.0, 4.0, 0.8))
    plate.apply_translation((0.0, 0.0, TOP + 2.0))
    report = check(face(), trimesh.util.concatenate([part, plate]), hayashi, tmp_path)
    assert report.figures["stock_gouge_mm"] == pytest.approx(0.4, abs=0.05)
    assert [f for f in report.findings if f.code == "gouge" and "finished part lacks" in f.message]


@pytest.mark.parametrize(("levels", "collides"), [((TOP,), True), ((12.0, 8.0, TOP), False)])
def test_a_holder_is_kept_clear_of_the_stock_as_it_is_then(levels, collides, part, hayashi, tmp_path):
    """At full depth at once the holder, 9 mm above the tip, meets 12 mm of stock; level by level none."""
    held = Tool(shapes.ball(2.0 * RADIUS, length=8.0), holder=Holder(9.0, (Section(20.0, 20.0),)))
    tips = np.concatenate([face(1.0) + np.array([0.0, 0.0, z - TOP]) for z in levels])
    report = check(tips, part, hayashi, tmp_path, held, "box:13:13:16")
    assert ("holder-collision" in report.counts) is collides
    assert (report.figures["holder_in_stock_mm3"] > 1.0) is collides
    assert report.figures["shank_in_stock_mm3"] == 0.0 or collides


@pytest.mark.parametrize(("height", "collides"), [(0.5, True), (0.9, True), (1.2, False), (5.0, False)])
def test_rapid_moves_of_the_cutter_are_held_against_the_stock_that_is_left(
    height, collides, part, hayashi, tmp_path
):
    """Half of the top is cut, and the rest is 1 mm higher; the way up from the cut is clear."""
    tips = face()
    tips = tips[tips[:, 1] <= 0.0]
    x, y, _ = tips[-1]
    over = TOP + height
    tips = np.concatenate([tips, [(x, y, over), (0.0, y, over), (0.0, 4.0, over)]])
    report = check(tips, part, hayashi, tmp_path, rapids=3, tool=Tool.ball(2.0 * RADIUS))
    assert ("fixture-collision" in report.counts) == collides
    assert not any("out of the stock" in gap for gap in report.not_checked)
    if collides:
        (found,) = [f for f in report.findings if f.code == "fixture-collision"]
        assert "rapid move" in found.message
