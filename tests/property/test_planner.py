"""Laws of planned paths, whatever the part and the options."""

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.base.errors import Infeasible, MeshError
from fiveaxis.cam import PlanOptions, TriangleTree, path_quality, plan_contour
from fiveaxis.model import Tool

RADIUS = 2.0


def part(kind: str, seed: int) -> trimesh.Trimesh:
    if kind == "hull":
        return trimesh.convex.convex_hull(np.random.default_rng(seed).uniform(-10.0, 10.0, (14, 3)))
    if kind == "torus":
        return trimesh.creation.torus(major_radius=10.0, minor_radius=3.0 + seed % 3)
    blocks = [trimesh.creation.box(extents=[8.0, 8.0, 12.0]) for _ in range(3)]
    for block, place in zip(blocks, np.random.default_rng(seed).uniform(-9.0, 9.0, (3, 3)), strict=True):
        block.apply_translation(place)
    return trimesh.util.concatenate(blocks)


waterlines = st.fixed_dictionaries(
    {"strategy": st.just("waterline")},
    optional={"stepdown": st.floats(1.0, 5.0), "scallop": st.floats(0.05, 0.5), "spiral": st.booleans()},
)
rasters = st.fixed_dictionaries(
    {"strategy": st.just("raster"), "raster_angle": st.floats(-360.0, 360.0)},
    optional={"stepover": st.floats(1.0, 5.0), "scallop": st.floats(0.05, 0.5)},
)
common = st.fixed_dictionaries(
    {"spacing": st.floats(0.4, 2.0)},
    optional={
        "overhang": st.booleans(),
        "direction": st.sampled_from(["climb", "conventional", "zigzag"]),
        "order": st.sampled_from(["levels", "islands"]),
        "lead_in": st.floats(0.1, 5.0),
        "lead_out": st.floats(0.1, 5.0),
        "clearance": st.floats(0.5, 10.0),
    },
)


@settings(max_examples=15)
@given(
    kind=st.sampled_from(["hull", "torus", "blocks"]),
    seed=st.integers(0, 1000),
    way=st.one_of(waterlines, rasters),
    rest=common,
)
def test_the_ball_touches_where_it_cuts_and_gouges_nowhere(kind, seed, way, rest):
    mesh = part(kind, seed)
    options = way | rest
    try:
        path = plan_contour(mesh, Tool.ball(2.0 * RADIUS), **options)
    except (Infeasible, MeshError) as refused:
        if "wall" not in str(refused):
            raise
        return
    tree = TriangleTree.build(np.array(mesh.triangles))
    assert np.isfinite(path.pivot).all()
    assert tree.distances(path.pivot).min() >= RADIUS - 0.0101
    middles = (path.pivot[1:] + path.pivot[:-1]) / 2.0
    assert tree.distances(middles).min() >= RADIUS - 0.0201
    contact, normal = path.contact[path.cutting], path.normal[path.cutting]
    # The contact is along the smoothed normal; the ball itself stands on a facet.
    assert tree.distances(path.pivot[path.cutting]).max() < RADIUS + 1e-6
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-9)
    np.testing.assert_allclose(contact + RADIUS * normal, path.pivot[path.cutting], atol=1e-9)
    assert not path.cutting[[0, -1]].any()
    assert path.pivot[[0, -1], 2].min() > mesh.bounds[1, 2]
    known = {name: options[name] for name in ("strategy", "raster_angle", "overhang") if name in options}
    measured = path_quality(path, mesh, PlanOptions(**known))
    # The mean of equal heights may exceed them by a rounding.
    assert 0.0 <= measured.scallop_mean <= measured.scallop_largest * (1.0 + 1e-12)
    assert measured.scallop_largest <= 2.0 * RADIUS
