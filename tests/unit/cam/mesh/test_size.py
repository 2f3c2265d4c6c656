"""The unit of a mesh file, and sizes that no part of a five-axis machine has."""

import re

import numpy as np
import pytest
import trimesh

from fiveaxis.base.errors import JobError, SettingError
from fiveaxis.cam import load_mesh, size_findings, size_text
from fiveaxis.job import load_surroundings, make_job
from fiveaxis.job.loading import load_job_toolpath


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "block.stl"
    trimesh.creation.box(extents=[2.0, 2.0, 1.0]).export(path)
    return path


@pytest.mark.parametrize(
    ("unit", "text"),
    [("mm", "2 × 2 × 1 mm"), ("inch", "50.8 × 50.8 × 25.4 mm"), ("m", "2000 × 2000 × 1000 mm")],
)
def test_a_mesh_is_read_in_its_unit(file, unit, text):
    assert size_text(load_mesh(file, unit=unit).extents) == text


def test_an_unknown_unit_names_the_known_ones(file):
    with pytest.raises(SettingError, match="unit = 'foot' must be mm, inch, m"):
        load_mesh(file, unit="foot")


@pytest.mark.parametrize(
    ("extent", "diameter", "reason"),
    [
        (2.0, 1.0, r"below 5 mm \(parts of 5-axis machines\)"),
        (19.0, 10.0, r"below 20 mm \(twice the cutter's diameter\)"),
        (6000.0, 10.0, "above 5000 mm"),
        (50.0, 10.0, None),
        (5000.0, 10.0, None),
    ],
)
def test_an_implausible_size_is_one_warning_with_the_sizes_in_other_units(extent, diameter, reason):
    size = np.array([extent, extent, extent / 2.0])
    found = size_findings(size, unit="mm", diameter=diameter, name="block.stl")
    assert len(found) == (reason is not None)
    if reason is not None:
        assert found[0].code == "part-size"
        assert f"measures {size_text(size)}, read in mm" in found[0].message
        assert f"inch makes it {size_text(25.4 * size)}" in found[0].message
        assert re.search(reason, found[0].message)


def test_part_and_stock_of_a_job_have_its_units(file):
    planned = load_surroundings(make_job(input=file, stock=file, unit="inch"))
    assert size_text(planned.part.extents) == size_text(planned.stock.extents) == "50.8 × 50.8 × 25.4 mm"
    apart = load_surroundings(make_job(input=file, stock=file, unit="inch", part_unit="m"))
    assert size_text(apart.part.extents) == "50.8 × 50.8 × 25.4 mm"
    assert size_text(apart.stock.extents) == "2000 × 2000 × 1000 mm"
    path = file.with_suffix(".apt")
    path.write_text("UNITS/MM\nGOTO/0,0,0,0,0,1\n")
    read = load_surroundings(make_job(input=path, part=file, unit="inch"))
    assert size_text(read.part.extents) == "2 × 2 × 1 mm"


def test_a_path_in_metres_is_refused(file, tmp_path):
    points = tmp_path / "path.csv"
    points.write_text("x,y,z,i,j,k\n0,0,0,0,0,1\n1,0,0,0,0,1\n")
    with pytest.raises(JobError, match="unit = m is for meshes, and the input is none; give mm or inch"):
        load_job_toolpath(make_job(input=points, tool="ball:2", unit="m"))
