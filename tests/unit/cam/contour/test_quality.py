import numpy as np
import pytest
import trimesh

from fiveaxis.base.errors import SettingError
from fiveaxis.cam import PlanOptions, path_quality, plan_contour
from fiveaxis.model import Tool, Toolpath


def upright(x: float, width: float = 20.0, height: float = 20.0) -> trimesh.Trimesh:
    """A block whose wall x = `x` is looked at."""
    block = trimesh.creation.box(extents=[10.0, width, height])
    block.apply_translation([x - 5.0, 0.0, 0.0])
    return block


def on_wall(heights: list[float], *, spacing: float = 0.5) -> Toolpath:
    """Passes at some heights on the wall x = 0, each along y, with a link between them."""
    paths = []
    for z in heights:
        y = np.arange(-5.0, 5.0 + spacing / 2.0, spacing)
        paths.append(np.c_[np.zeros_like(y), y, np.full_like(y, z)])
    path = Toolpath.from_contacts(
        np.vstack(paths), np.tile([1.0, 0.0, 0.0], (sum(map(len, paths)), 1)), Tool.ball(6)
    )
    links = np.zeros(len(path), dtype=bool)
    # The first row of each pass ends a link: it is made air, as approaches are.
    links[np.cumsum([len(p) for p in paths])[:-1]] = True
    return path.with_links(links)


def test_ridges_on_a_flat_wall_have_the_height_of_the_textbook():
    found = path_quality(on_wall([0.0, 1.0, 2.0]), upright(0.0))
    expected = 3.0 - np.sqrt(9.0 - 0.25)
    assert found.scallop_largest == pytest.approx(expected, rel=1e-9)
    assert found.scallop_mean == pytest.approx(expected, rel=1e-9)
    assert found.chord_largest == pytest.approx(0.0, abs=1e-9)


def test_the_widest_gap_decides_the_largest_ridge_and_both_the_mean():
    found = path_quality(on_wall([0.0, 1.0, 3.0]), upright(0.0))
    low, high = (3.0 - np.sqrt(9.0 - d * d / 4.0) for d in (1.0, 2.0))
    assert found.scallop_largest == pytest.approx(high, rel=1e-9)
    assert low < found.scallop_mean < high


def test_passes_farther_apart_than_the_ball_is_wide_share_no_ridge():
    found = path_quality(on_wall([0.0, 6.5]), upright(0.0))
    assert found.ridges == 0
    assert found.edges > 0
    assert found.scallop_largest == found.scallop_mean == 0.0


def test_contacts_of_a_neighbour_may_lie_anywhere_along_it():
    # A neighbour's contacts lie up to 1 mm along the pass: its line counts, not its points.
    found = path_quality(on_wall([0.0, 1.0], spacing=2.0), upright(0.0))
    assert found.scallop_largest == pytest.approx(3.0 - np.sqrt(9.0 - 0.25), rel=1e-9)


def test_the_two_sides_of_a_thin_wall_are_no_neighbours():
    thin = trimesh.creation.box(extents=[1.0, 40.0, 20.0])
    path = plan_contour(thin, Tool.ball(6), stepdown=1.0)
    found = path_quality(path, thin)
    assert found.scallop_largest == pytest.approx(3.0 - np.sqrt(9.0 - 0.25), rel=0.03)


def test_the_chord_error_of_a_cylinder_is_that_of_its_circle():
    cylinder = trimesh.creation.cylinder(radius=10.0, height=6.0, sections=2000)
    angle = np.linspace(0.0, 0.5, 6)
    normal = np.c_[np.cos(angle), np.sin(angle), np.zeros(6)]
    path = Toolpath.from_contacts(10.0 * normal, normal, Tool.ball(6))
    found = path_quality(path, cylinder).chord_largest
    assert found == pytest.approx(13.0 * (1.0 - np.cos(0.05)), abs=1e-4)


def test_ridges_of_a_hollow_are_lower_than_those_of_a_boss():
    ring = trimesh.creation.annulus(r_min=10.0, r_max=16.0, height=20.0, sections=256)
    turned = trimesh.transformations.rotation_matrix(np.pi / 2.0, [0.0, 1.0, 0.0])
    ring.apply_transform(turned)
    angle = np.array([-0.05, 0.05])
    heights = {}
    for radius, side in ((10.0, -1.0), (16.0, 1.0)):
        # Two passes along x, 0.1 rad apart about it.
        around = np.c_[np.zeros(2), np.cos(angle), np.sin(angle)]
        x = np.linspace(-5.0, 5.0, 21)
        points = np.vstack([radius * a + np.c_[x, np.zeros((21, 2))] for a in around])
        path = Toolpath.from_contacts(points, np.repeat(side * around, 21, axis=0), Tool.ball(6))
        found = path_quality(path.with_links(np.arange(42) == 21), ring)
        apart = 2.0 * (radius + side * 3.0) * np.sin(0.05)
        tip = (radius + side * 3.0) * np.cos(0.05) - side * np.sqrt(9.0 - apart**2 / 4.0)
        heights[side] = side * (tip - radius)
        assert found.scallop_largest == pytest.approx(heights[side], abs=1e-3)


def test_material_left_in_an_inner_corner_is_no_ridge():
    # Two blocks form a corner of 90 degrees that a ball of 10 mm can't finish.
    corner = trimesh.util.concatenate([upright(0.0, 60.0), upright(30.0, 20.0)])
    path = plan_contour(corner, Tool.ball(10), scallop=0.01, strategy="raster", raster_angle=90.0)
    assert (
        path_quality(path, corner, PlanOptions(strategy="raster", raster_angle=90.0)).scallop_largest < 0.012
    )


def test_faces_that_the_strategy_leaves_out_have_no_ridges():
    cylinder = trimesh.creation.cylinder(radius=10.0, height=40.0, sections=256)
    cylinder.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2.0, [0.0, 1.0, 0.0]))
    path = plan_contour(cylinder, Tool.ball(6), scallop=0.01)
    assert path_quality(path, cylinder).scallop_largest < 0.0105


@pytest.mark.parametrize(
    "options",
    [
        {},
        pytest.param({"strategy": "raster", "raster_angle": 30.0}, marks=pytest.mark.slow),
        pytest.param({"spiral": True}, marks=pytest.mark.slow),
    ],
)
def test_planned_ridges_of_a_sphere_have_the_wanted_height(options):
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=20.0)
    chords = 20.0 - np.linalg.norm(sphere.triangles_center, axis=1).min()
    path = plan_contour(sphere, Tool.ball(6), scallop=0.03, spacing=1.0, **options)
    found = path_quality(path, sphere, PlanOptions(**options))
    assert 0.02 < found.scallop_mean < found.scallop_largest < 0.03 + chords
    assert found.ridges > 5000


def test_lengths_add_up_to_the_paths():
    block = upright(0.0)
    path = plan_contour(block, Tool.ball(6), stepdown=5.0)
    found = path_quality(path, block)
    assert found.cut_length + found.link_length == pytest.approx(path.lengths.sum())


def test_wrong_options_are_refused():
    with pytest.raises(SettingError, match="raster_angle"):
        path_quality(on_wall([0.0]), upright(0.0), PlanOptions(raster_angle=3.0))
