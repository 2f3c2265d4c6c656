"""Where a stock comes from, and what is refused before the work begins."""

import math

import numpy as np
import pytest
import trimesh

from fiveaxis.base.errors import JobError, MeshError, SettingError
from fiveaxis.cam import Mesh
from fiveaxis.check import Blank, save_stock
from fiveaxis.check.stock.display import mesh_of
from fiveaxis.check.stock.sources import load_stock, of_mesh, read_stock

PITCH = 0.25


@pytest.fixture(scope="module")
def part() -> trimesh.Trimesh:
    mesh = trimesh.creation.box(extents=(20.0, 10.0, 5.0))
    mesh.apply_translation((3.0, -2.0, 7.5))
    return mesh


def test_a_box_stands_about_the_part_from_its_lowest_point(part):
    stock = load_stock("box:24:14:8", part, PITCH)
    assert stock.volumes() == pytest.approx(24.0 * 14.0 * 8.0)
    assert stock.low == pytest.approx((-9.0, -9.0, 5.0))
    assert stock.high == pytest.approx((15.0, 5.0, 13.0))


def test_a_cylinder_stands_about_the_part(part):
    stock = load_stock("cylinder:24:8", part, PITCH)
    assert stock.volumes() == pytest.approx(144.0 * math.pi * 8.0, rel=1e-3)


def test_the_rays_of_a_bar_end_on_its_circle_and_its_faces(part):
    surface = load_stock("cylinder:24:8", part, PITCH).surface()
    low, high = part.bounds
    aside = np.linalg.norm(surface.points[:, :2] - (low + high)[:2] / 2.0, axis=1)
    assert aside[surface.direction < 2] == pytest.approx(12.0, abs=1e-5)
    height = surface.points[surface.direction == 2, 2] - low[2]
    assert np.minimum(height, 8.0 - height) == pytest.approx(0.0, abs=1e-5)


def test_an_allowance_rounds_edges_and_corners(part):
    a, (x, y, z) = 0.5, part.extents
    rounded = x * y * z + 2.0 * a * (x * y + y * z + z * x) + math.pi * a * a * (x + y + z)
    stock = load_stock("part+0.5", part, PITCH)
    assert stock.volumes() == pytest.approx(rounded + 4.0 / 3.0 * math.pi * a**3, rel=3e-3)


def test_a_mesh_is_scanned_and_shown_again_with_its_volume():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=10.0)
    stock = of_mesh(ball, PITCH)
    assert stock.volumes() == pytest.approx(ball.volume, rel=1e-3)
    shown = mesh_of(stock)
    assert shown.is_watertight
    assert shown.volume == pytest.approx(ball.volume, rel=0.01)


def test_a_stock_comes_back_from_its_file(part, tmp_path):
    stock = load_stock("part+0.5", part, PITCH)
    again = read_stock(save_stock(stock, tmp_path / "rest.npz"))
    assert (again.volumes() == stock.volumes()).all()
    assert (again.surface().points == stock.surface().points).all()


def test_a_default_resolution_is_a_tenth_of_a_millimetre_on_60_mm(part):
    assert load_stock("box:24:14:8", part).resolution == pytest.approx(20.0 / 600.0, rel=0.02)


def test_a_stock_that_doesnt_contain_the_part_is_refused_with_where(part):
    with pytest.raises(JobError, match=r"reaches 1 mm out of it beyond its high side along Z"):
        Blank.of(load_stock("box:24:14:4", part, PITCH), part)
    bar = load_stock("cylinder:21:8", part, PITCH)
    with pytest.raises(JobError, match=r"doesn't contain the part, which reaches 0\.\d+ mm out of it at"):
        Blank.of(bar, part)


def test_a_stock_that_takes_too_much_memory_is_refused_with_what_is_enough(part):
    with pytest.raises(
        SettingError, match=r"takes .* GiB of memory, and 1 GiB are allowed; take 0\.00\d+ mm"
    ):
        load_stock("box:24:14:8", part, 0.001)


@pytest.mark.parametrize("text", ["box:24:14", "cylinder:3:4:5", "part+", "box:a:b:c", "box:1:1:-1"])
def test_a_stock_that_is_written_wrong_is_refused(part, text):
    with pytest.raises(SettingError, match="stock"):
        load_stock(text, part, PITCH)


def test_an_open_mesh_is_refused(part):
    open_mesh = trimesh.Trimesh(part.vertices, part.faces[1:], process=False)
    with pytest.raises(MeshError, match="isn't watertight"):
        load_stock(Mesh.of(open_mesh), part, PITCH)


def test_a_file_that_isnt_a_stock_is_refused(tmp_path, part):
    file = tmp_path / "rest.npz"
    file.write_bytes(b"nothing")
    with pytest.raises(JobError, match="isn't a stock that fiveaxis wrote"):
        load_stock(file, part)
