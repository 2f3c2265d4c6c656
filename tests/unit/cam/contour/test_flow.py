"""Passes along the faces of CAD files against closed forms and brute force."""

from importlib.util import find_spec

import numpy as np
import pytest
import trimesh
from support.cad_models import mesh
from support.leaned_paths import leaned
from support.left_over_material import left_over

from fiveaxis.base import angle_between
from fiveaxis.base.errors import MeshError
from fiveaxis.cam import PlanOptions, load_mesh, path_quality, plan_contour, plan_passes
from fiveaxis.job import make_job, run_job
from fiveaxis.model import Tool, Toolpath, parse_tool

pytestmark = pytest.mark.skipif(find_spec("OCP") is None, reason="needs Open Cascade: fiveaxis[step]")
# mm and deg: what planned contacts may be off.
OFF, TURNED = 1e-3, 0.01
BLADE = "1,2,3,4"
BOUNDS = {"lead": (4.0, 6.0), "lean": (-0.5, 0.5)}


def passes_of(part: trimesh.Trimesh, **options) -> list[tuple[np.ndarray, np.ndarray]]:
    """Contacts and normals of each pass, in cutting order."""
    plan = plan_passes(part, Tool.ball(6), PlanOptions(strategy="flow", **options))
    path, ends = plan.toolpath, zip(plan.first, plan.last, strict=True)
    return [(path.contact[a : b + 1], path.normal[a : b + 1]) for a, b in ends]


def of_sphere(p):
    length = np.linalg.norm(p, axis=1)
    return length - 10.0, p / length[:, None]


def of_torus(p):
    around = np.hypot(p[:, 0], p[:, 1])
    ring = np.column_stack([12.0 * p[:, 0] / around, 12.0 * p[:, 1] / around, 0.0 * around])
    length = np.linalg.norm(p - ring, axis=1)
    return length - 4.0, (p - ring) / length[:, None]


def of_cylinder(p):
    length = np.hypot(p[:, 0], p[:, 1])
    return length - 5.0, p * [1.0, 1.0, 0.0] / length[:, None]


def of_ruled(p):
    """The side between straight edges at z = 0 and 40, of chords 30 and 24, the second turned by 0.5 rad."""
    c, s, v = np.cos(0.5), np.sin(0.5), p[:, 2:] / 40.0
    low = np.array([[-15.0, -1.0, 0.0], [15.0, -1.0, 0.0]])
    high = np.array([[c * x + s, s * x - c, 40.0] for x in (-12.0, 12.0)])
    start, end = ((1.0 - v) * low[k] + v * high[k] for k in (0, 1))
    chord = end - start
    u = np.sum((p - start) * chord, axis=1) / np.sum(chord**2, axis=1)
    rising = (1.0 - u)[:, None] * (high[0] - low[0]) + u[:, None] * (high[1] - low[1])
    normal = np.cross(chord, rising)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.sum((p - start) * normal, axis=1), normal


@pytest.mark.parametrize(
    ("name", "along", "form"),
    [
        pytest.param("sphere", "u", of_sphere, marks=pytest.mark.slow),
        pytest.param("torus", "v", of_torus, marks=pytest.mark.slow),
        pytest.param("cylinder", "u", of_cylinder, marks=pytest.mark.slow),
        ("cylinder", "v", of_cylinder),
        ("ruled", "v", of_ruled),
    ],
)
def test_contacts_lie_on_closed_forms_and_ridges_are_as_high_as_asked(parts, name, along, form):
    part, scallop = mesh(parts / f"{name}.step"), 0.03
    path = plan_contour(
        part, Tool.ball(6), strategy="flow", flow_along=along, faces="1", scallop=scallop, spacing=0.2
    )
    distance, normal = form(path.contact[path.cutting])
    assert np.abs(distance).max() < OFF
    assert np.degrees(angle_between(path.normal[path.cutting], normal)).max() < TURNED
    found = path_quality(path, part, PlanOptions(strategy="flow", faces="1"))
    assert found.scallop_largest == pytest.approx(scallop, rel=0.05)
    left = left_over(path, part.model, [0])
    assert left.max() < 1.06 * scallop


@pytest.mark.parametrize("tool", ["bull:6:1", "flat:6"])
@pytest.mark.parametrize(
    ("name", "strategy", "form", "least"),
    [
        pytest.param("sphere", "flow", of_sphere, 0.75, marks=pytest.mark.slow),
        pytest.param("torus", "flow", of_torus, 0.75, marks=pytest.mark.slow),
        ("ruled", "flow", of_ruled, 0.65),  # its lines fan out
        ("ruled", "waterline", of_ruled, 0.5),  # on a twisted wall the steepest place of each level counts
    ],
)
def test_other_cutters_leave_no_higher_ridges_and_not_much_lower_ones(
    parts, name, strategy, form, least, tool
):
    part, scallop = mesh(parts / f"{name}.step"), 0.03
    path = plan_contour(
        part, parse_tool(tool), strategy=strategy, faces="1", scallop=scallop, spacing=0.6, **BOUNDS
    )
    distance, normal = form(path.contact[path.cutting])
    assert np.abs(distance).max() < OFF
    assert np.degrees(angle_between(path.normal[path.cutting], normal)).max() < TURNED
    # Around the poles of the sphere the cutter would turn on the spot, and the ring's hole is too narrow.
    x, y, z = path.contact.T
    narrow = {"sphere": np.abs(z) > 9.0, "torus": np.hypot(x, y) < 12.0}.get(name, np.zeros(len(x), bool))
    kept = path.with_links(~path.cutting | narrow)
    found = path_quality(leaned(kept, 6.0, 0.5), part, PlanOptions(strategy=strategy, faces="1"))
    assert found.scallop_largest < 1.05 * scallop
    assert found.scallop_mean > least * scallop


@pytest.mark.parametrize("along", [None, "u", "v"])
def test_trimmed_faces_are_cut_up_to_slanted_borders_and_round_holes(parts, along):
    part, scallop = mesh(parts / "slanted.step"), 0.01
    exact = part.model
    walls = [i for i, face in enumerate(exact.faces) if face.kind == "cylinder" and face.area > 1000.0]
    assert len(walls) == 1
    path = plan_contour(
        part, Tool.ball(6), strategy="flow", flow_along=along, faces=str(walls[0] + 1), scallop=scallop
    )
    assert left_over(path, exact, walls).max() < 1.06 * scallop
    found = path_quality(path, part, PlanOptions(strategy="flow", faces=str(walls[0] + 1)))
    assert found.scallop_largest < 1.06 * scallop


def test_a_blade_of_four_faces_is_cut_around(parts):
    part = mesh(parts / "blade.step")
    exact = part.model
    passes = passes_of(part, faces=BLADE, scallop=0.05)
    for contact, normal in passes:
        assert set(exact.nearest(contact[::5]).face) == {0, 1, 2, 3}
        np.testing.assert_array_equal(contact[0], contact[-1])
        assert np.degrees(angle_between(normal[1:], normal[:-1])).max() < 30.0
    heights = [contact[:, 2].mean() for contact, _ in passes]
    assert heights == sorted(heights, reverse=True)


def test_one_spiral_winds_around_a_blade_and_leaves_no_higher_ridges(parts):
    part = mesh(parts / "blade.step")
    options = {"strategy": "flow", "faces": BLADE, "scallop": 0.05}
    plan = plan_passes(part, Tool.ball(6), PlanOptions(spiral=True, **options))
    assert len(plan.first) == 1
    path = plan.toolpath
    foot = part.model.nearest(path.contact[path.cutting])
    assert foot.distance.max() < OFF
    # Where faces meet, at whole numbers of u, their normals differ a little.
    inside = np.abs(foot.uv[:, 0] - np.round(foot.uv[:, 0])) > 1e-6
    assert np.degrees(angle_between(foot.normal, path.normal[path.cutting]))[inside].max() < TURNED
    found = path_quality(path, part, PlanOptions(strategy="flow", faces=BLADE))
    assert found.scallop_largest < 1.05 * 0.05


def test_along_the_other_parameter_passes_run_from_root_to_tip(parts):
    for contact, _ in passes_of(mesh(parts / "blade.step"), faces=BLADE, scallop=0.05, flow_along="v"):
        assert np.ptp(contact[:, 2]) > 39.9


@pytest.mark.parametrize("along", ["u", "v"])
def test_climbing_has_the_next_strip_to_the_right_and_conventional_to_the_left(parts, along):
    sides = []
    for direction in ("climb", "conventional"):
        passes = passes_of(
            mesh(parts / "ruled.step"), faces="1", stepover=3.0, flow_along=along, direction=direction
        )
        contact, normal = passes[1]
        right = np.cross(contact[-1] - contact[0], normal[len(normal) // 2])
        sides.append(np.sum(right * (passes[2][0].mean(axis=0) - contact.mean(axis=0))))
    assert sides[0] > 0.0 > sides[1]


def test_a_stepover_is_measured_on_the_surface(parts):
    passes = passes_of(mesh(parts / "cylinder.step"), faces="1", stepover=2.0, flow_along="v")
    angles = np.sort([np.arctan2(*contact[0, 1::-1]) for contact, _ in passes])
    # 2 pi 5 mm in 16 equal steps of at most 2 mm.
    np.testing.assert_allclose(np.diff(angles) * 5.0, np.pi * 10.0 / 16.0, atol=1e-6)


def test_what_lies_on_the_table_is_cut_only_where_it_is_named(parts):
    part = mesh(parts / "sphere.step")
    whole, named = (passes_of(part, stepover=1.0, faces=faces) for faces in (None, "1"))
    lowest = [min(normal[:, 2].min() for _, normal in passes) for passes in (whole, named)]
    assert lowest[0] >= -np.cos(np.radians(10.0)) > lowest[1]


def test_islands_and_zigzag_reorder_the_same_passes(parts):
    def figures(path: Toolpath) -> tuple[int, float]:
        return int(path.cutting.sum()), float(path.lengths[~path.cutting].sum())

    options = {"strategy": "flow", "stepover": 2.0}
    levels = figures(plan_contour(mesh(parts / "slanted.step"), Tool.ball(6), **options))
    zigzag = figures(
        plan_contour(
            mesh(parts / "slanted.step"), Tool.ball(6), order="islands", direction="zigzag", **options
        )
    )
    assert zigzag[0] == pytest.approx(levels[0], abs=30)
    assert zigzag[1] < levels[1]


def test_a_mesh_has_no_faces_to_flow_along():
    with pytest.raises(MeshError, match=r"strategy = 'flow' follows the faces of a CAD file, .*\(.step\)"):
        plan_contour(trimesh.creation.box(extents=[10.0] * 3), Tool.ball(4), strategy="flow")


def test_faces_without_overhangs_say_so(parts):
    with pytest.raises(MeshError, match="has no overhanging wall on its faces"):
        plan_contour(mesh(parts / "cylinder.step"), Tool.ball(4), strategy="flow", faces="1", overhang=True)


@pytest.mark.slow
def test_faces_of_the_propeller_are_cut_as_far_as_the_ball_has_room(data):
    part = data / "step" / "propeller_d.step"
    exact = load_mesh(part).model
    path = plan_contour(part, Tool.ball(6), strategy="flow", faces="12", scallop=0.01)
    contact = path.contact[path.cutting]
    foot = exact.nearest(contact, np.full(len(contact), 11))
    assert foot.distance.max() < OFF
    assert np.degrees(angle_between(foot.normal, path.normal[path.cutting])).max() < TURNED
    assert exact.nearest(path.pivot).distance.min() > 3.0 - 0.02
    left = left_over(path, exact, [11])
    # Where the ball has no clear link, a few contacts are left out, and told.
    assert np.percentile(left, 99.0) < 0.0105
    assert [found.code for found in path.findings] == ["contacts-left-out"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cutter", "bounds"),
    [("flat:10", {"lead": (5.0, 25.0), "lean": (-5.0, 5.0)}), ("bull:10:2", {"tilt": (15.0, 60.0)})],
)
def test_cutters_of_every_kind_get_from_the_model_to_a_program_without_errors(parts, cutter, bounds):
    plan = {"strategy": "flow", "faces": "1", "stepover": 5.0, "spacing": 2.0}
    job = make_job(
        input=parts / "ruled.step", machine="hayashi-640123", effort="quick", tool=cutter, plan=plan, **bounds
    )
    outcome = run_job(job)
    assert outcome.ok
    assert outcome.verdict.figures["gouge_depth_mm"] < 0.02
