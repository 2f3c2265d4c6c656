"""The stock in the page: as it is cut, at any time, and coloured by what is left in the end."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from support.stock_on_page import surface, unpacked

from fiveaxis.base import Workpiece
from fiveaxis.check import Surroundings
from fiveaxis.check.stock.colouring import FINISHED, LEFT, UNCUT
from fiveaxis.model import tool_poses
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside

RESOLUTION = 1.0  # mm


def test_the_stock_is_there_at_first_and_is_cut_as_by_the_program_at_the_end(
    stock_page, stocked, cut_program
):
    head, arrays = unpacked(stock_page)
    clock = arrays["stock/clock"]
    assert clock[0] == 0.0
    assert clock[-1] == pytest.approx(arrays["0/clock"][-1])
    first, last = surface(head, arrays, 0), surface(head, arrays, len(clock) - 1)
    assert first.volume == pytest.approx(stocked.blank.stock.volumes().mean(), rel=0.01)
    removed = cut_program.report.cut.removal.volume.sum(axis=1).mean()
    assert first.volume - last.volume == pytest.approx(removed, rel=0.03)


def test_what_is_removed_lies_where_the_tool_has_been(stock_page, solution):
    head, arrays = unpacked(stock_page)
    clock, moves = arrays["stock/clock"], arrays["0/clock"]
    step = len(clock) // 3
    row = int(np.searchsorted(moves, clock[step]))
    born, gone = arrays["stock/born"], arrays["stock/gone"]
    quads = arrays["stock/quads"].reshape(-1, 4)[(born > 0) & (born <= step) & (step < gone)]
    points = arrays["stock/vertices"].reshape(-1, 3)[np.unique(quads)] + head["stock"]["low"]
    away = np.linalg.norm(points[:, None] - solution.toolpath.pivot[None, : row + 1], axis=2).min(axis=1)
    tip, axis = tool_poses(solution.machine, solution.motion.positions[: row + 1])
    heights = np.linspace(0.0, 80.0, 160)
    along = (tip[:, None] + heights[:, None] * axis[:, None]).reshape(-1, 3)
    away = np.minimum(away, cKDTree(along).query(points)[0])
    assert len(points) > 100
    assert away.max() < solution.toolpath.tool.radius + 2.0 * RESOLUTION


def test_a_motion_that_is_shown_with_fewer_rows_cuts_with_all_of_them(
    stock_page, solution, stocked, cut_program, monkeypatch
):
    monkeypatch.setattr("fiveaxis.show.viewer.moves.MOST_ROWS", 20)
    thin = unpacked(render_page(solution, Beside(program=cut_program, surroundings=stocked)))[1]
    whole = unpacked(stock_page)[1]
    assert len(thin["0/clock"]) <= 20 < len(whole["0/clock"])
    for name in (name for name in whole if name.startswith("stock/")):
        np.testing.assert_array_equal(thin[name], whole[name])


def test_what_remains_is_coloured_by_what_is_left(stock_page):
    head, arrays = unpacked(stock_page)
    colours = arrays["stock/colours"].reshape(-1, 3)
    last = np.unique(surface(head, arrays, len(arrays["stock/clock"]) - 1).faces)
    before = np.setdiff1d(np.arange(len(colours)), last)
    assert (colours[before] == UNCUT).all()
    found = {tuple(c) for c in colours[last].tolist()}
    assert {UNCUT, FINISHED} <= found
    assert any(b > r for r, _, b in found), f"nothing of {LEFT}"
    assert 'id="map"' in stock_page
    assert "within 0.05 mm of the part" in stock_page


def test_the_map_has_the_tolerance_of_the_stock(solution, part, cut_program):
    around = Surroundings.of(
        Workpiece(part=part, stock="part+2", stock_resolution=RESOLUTION, stock_tolerance=0.2)
    )
    page = render_page(solution, Beside(program=cut_program, surroundings=around))
    assert "within 0.2 mm of the part" in page
    assert "dark from 2 mm" in page


def test_without_a_verified_program_the_stock_is_cut_and_has_no_map(solution, stocked):
    page = render_page(solution, Beside(surroundings=stocked))
    head, arrays = unpacked(page)
    assert surface(head, arrays, 2000).volume < surface(head, arrays, 0).volume
    assert 'id="map"' not in page
    assert render_page(solution, Beside(surroundings=stocked)) == page


def test_a_stock_that_isnt_cut_is_shown_as_before(solution, part):
    around = Surroundings(part=part, stock=trimesh.creation.box(extents=(100.0, 100.0, 40.0)))
    head, _ = unpacked(render_page(replace(solution, compared={}), Beside(surroundings=around)))
    assert "stock" not in head


def test_the_removal_rate_adds_up_to_what_is_removed(stock_page):
    head, arrays = unpacked(stock_page)
    clock, rate = arrays["stock/clock"], arrays["stock/rate"]
    first, last = (surface(head, arrays, step).volume for step in (0, len(clock) - 1))
    assert (rate >= 0.0).all()
    assert (rate[1:] * np.diff(clock)).sum() == pytest.approx(first - last, rel=0.03)
