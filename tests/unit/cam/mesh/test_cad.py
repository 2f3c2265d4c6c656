"""Exact surfaces of CAD files against closed forms, brute force and Open Cascade; broken files."""

import pickle
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from support.cad_models import mesh as read
from support.cad_models import model

import fiveaxis as fx
from fiveaxis.base import CadFile
from fiveaxis.base.errors import MeshError, MissingDependency, SettingError
from fiveaxis.cam import Mesh, Model, PlanOptions, load_mesh, path_quality, tree_of
from fiveaxis.cam.mesh.cad import loading
from fiveaxis.cam.mesh.cad.choice import survey
from fiveaxis.cam.mesh.loading import check_mesh
from fiveaxis.check.verification.check_context import Tolerances
from fiveaxis.check.verification.cutting_body import CuttingBody
from fiveaxis.check.verification.gouging import PartDepths
from fiveaxis.model import parse_tool, tool_poses
from fiveaxis.show import write_preview
from fiveaxis.show.viewer.numbers import number_marks

pytestmark = pytest.mark.skipif(find_spec("OCP") is None, reason="needs Open Cascade: fiveaxis[step]")
MAKER = Path(__file__).parents[3] / "support/cad_parts.py"
# mm and rad: what rounding leaves of a distance and of a normal.
ROUNDING, TURNED = 1e-9, 1e-8


def points_near(part: Model, count: int, off: float) -> np.ndarray:
    rng = np.random.default_rng(7)
    rows = rng.integers(len(part.corners), size=count)
    return part.corners[rows].mean(axis=1) + rng.uniform(-off, off, size=(count, 3))


def of_sphere(p):
    length = np.linalg.norm(p, axis=1)
    return np.abs(length - 10.0), p / length[:, None]


def of_torus(p):
    around = np.hypot(p[:, 0], p[:, 1])
    ring = np.column_stack([12.0 * p[:, 0] / around, 12.0 * p[:, 1] / around, 0.0 * around])
    length = np.linalg.norm(p - ring, axis=1)
    return np.abs(length - 4.0), (p - ring) / length[:, None]


@pytest.mark.parametrize(("name", "form"), [("sphere", of_sphere), ("torus", of_torus)])
def test_nearest_points_agree_with_the_closed_form(parts, name, form):
    part = model(parts / f"{name}.step")
    points = points_near(part, 3000, 1.5)
    foot, (distance, normal) = part.nearest(points), form(points)
    assert np.abs(foot.distance - distance).max() < ROUNDING
    assert np.linalg.norm(foot.normal - normal, axis=1).max() < TURNED


@pytest.mark.parametrize(("name", "slope"), [("cylinder", 0.0), ("cone", 5.0 / 12.0)])
def test_walls_of_cylinders_and_cones_agree_with_the_closed_form(parts, name, slope):
    part = model(parts / f"{name}.step")
    wall = next(i for i, face in enumerate(part.faces) if face.kind == name)
    rng = np.random.default_rng(3)
    turn, height, off = rng.uniform(0.0, 6.28, 2000), rng.uniform(2.0, 10.0, 2000), rng.uniform(-1, 1, 2000)
    radius = (5.0 if name == "cylinder" else 8.0) - slope * height
    outward = np.column_stack([np.cos(turn), np.sin(turn), np.full(2000, slope)]) / np.hypot(1.0, slope)
    on = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])
    foot = part.nearest(on + off[:, None] * outward, np.full(2000, wall))
    assert np.abs(foot.point - on).max() < ROUNDING
    assert np.abs(foot.normal - outward).max() < ROUNDING
    bends = part.curvatures(wall, foot.uv)
    expected = np.column_stack([-1.0 / np.hypot(1.0, slope) / radius, np.zeros(2000)])
    assert np.abs(bends - expected).max() < ROUNDING


def test_the_inside_of_a_ring_is_concave_for_a_cutter_outside(parts):
    part = model(parts / "torus.step")
    inner, outer = part.nearest(np.array([[7.0, 0.0, 0.0], [17.0, 0.0, 0.0]])).uv[:, None]
    assert part.curvatures(0, inner)[0] == pytest.approx([-0.25, 0.125])
    assert part.curvatures(0, outer)[0] == pytest.approx([-0.25, -0.0625])


@pytest.mark.parametrize("name", ["blade", "ruled", "swept", "tip"])
def test_no_sampled_point_is_nearer_than_the_nearest(parts, name):
    part = model(parts / f"{name}.step")
    rng = np.random.default_rng(5)
    doubled = np.cross(*np.diff(part.corners, axis=1).swapaxes(0, 1))
    areas = np.linalg.norm(doubled, axis=1)
    rows = rng.choice(len(areas), size=200_000, p=areas / areas.sum())
    uv = np.einsum("ij,ijk->ik", rng.dirichlet((1, 1, 1), len(rows)), part.corners_uv[rows])
    samples = part.evaluate(part.owner[rows], uv)[:, 0]
    points = points_near(part, 60, 2.0)
    least = np.array([np.linalg.norm(samples - p, axis=1).min() for p in points])
    distance = part.nearest(points).distance
    # The border's chords, and how far apart samples are.
    assert (distance <= least + 2e-3).all()
    assert (least <= distance + 0.3).all()


@pytest.mark.parametrize("name", ["swept", "torus", "tip"])
def test_areas_are_those_of_the_surfaces(parts, name):
    part = model(parts / f"{name}.step")
    share, weight = np.polynomial.legendre.leggauss(20)
    # Four intervals of it: a curve has a knot at a quarter or at half of its parameters, or none.
    share, weight = np.ravel((share[:, None] + [1, 3, 5, 7]) / 8.0), np.repeat(weight / 8.0, 4)
    whole = [i for i, face in enumerate(part.faces) if face.kind != "plane"]
    assert whole
    for i in whole:
        u0, u1, v0, v1 = part.trims.box[i]
        u, v = (grid.ravel() for grid in np.meshgrid(u0 + share * (u1 - u0), v0 + share * (v1 - v0)))
        rows = part.evaluate(np.full(len(u), i), np.column_stack([u, v]))
        sizes = np.linalg.norm(np.cross(rows[:, 1], rows[:, 2]), axis=1)
        area = (u1 - u0) * (v1 - v0) * np.outer(weight, weight).ravel() @ sizes
        assert part.faces[i].area == pytest.approx(area, rel=1e-9)


@pytest.mark.parametrize("name", ["blade", "torus", "cone", "rational"])
def test_derivatives_are_those_of_the_surface(parts, name):
    part, step = model(parts / f"{name}.step"), 1e-5
    rng = np.random.default_rng(1)
    face = rng.integers(len(part.faces), size=500)
    u0, u1, v0, v1 = part.trims.box[face].T
    share = rng.uniform(0.1, 0.9, (500, 2))
    uv = np.column_stack([u0 + share[:, 0] * (u1 - u0), v0 + share[:, 1] * (v1 - v0)])
    here = part.evaluate(face, uv)
    for column, along in ((1, [step, 0.0]), (2, [0.0, step])):
        ahead, behind = (part.evaluate(face, uv + sign * np.array(along)) for sign in (1, -1))
        slopes = (ahead - behind) / (2.0 * step)
        assert np.abs(slopes[:, 0] - here[:, column]).max() < 1e-5
        second = (3, 4) if column == 1 else (4, 5)
        assert np.abs(slopes[:, 1] - here[:, second[0]]).max() < 1e-4
        assert np.abs(slopes[:, 2] - here[:, second[1]]).max() < 1e-4


def classified(path: Path, part: Model, folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    face = rng.integers(len(part.faces), size=4000)
    u0, u1, v0, v1 = part.trims.box[face].T
    share = rng.uniform(size=(4000, 2))
    uv = np.column_stack([u0 + share[:, 0] * (u1 - u0), v0 + share[:, 1] * (v1 - v0)])
    asked, answer = folder / "asked.npz", folder / "answer.npy"
    np.savez(asked, face=face, uv=uv)
    call = [sys.executable, str(MAKER), "classify", str(path), str(asked), str(answer)]
    subprocess.run(call, check=True, capture_output=True, timeout=300)
    return face, uv, np.load(answer)


def test_faces_are_trimmed_as_open_cascade_trims_them(data, tmp_path):
    propeller = data / "step" / "propeller_d.step"
    part = model(propeller)
    face, uv, expected = classified(propeller, part, tmp_path)
    ours = np.zeros(len(face), dtype=bool)
    for i in range(len(face)):
        pieces = part.intervals(int(face[i]), "u", float(uv[i, 1]))
        ours[i] = ((pieces[:, 0] <= uv[i, 0]) & (uv[i, 0] <= pieces[:, 1])).any()
    assert 0.2 < expected.mean() < 1.0
    assert (ours != expected).mean() < 1e-3


def test_contacts_lie_on_the_exact_surface_with_its_normal(parts):
    part = read(parts / "torus.step", mesh_tolerance=0.1)
    path = fx.plan_contour(part, fx.Tool.ball(3.0), stepdown=1.0)
    distance, normal = of_torus(path.contact[path.cutting])
    assert distance.max() < 1e-3
    turned = np.linalg.norm(normal - path.normal[path.cutting], axis=1).max()
    assert np.degrees(turned) < 0.01
    assert path.normals_from == "of the model's surfaces (torus.step)"


def test_only_the_chosen_faces_are_cut(parts):
    path = fx.plan_contour(read(parts / "cone.step"), fx.Tool.ball(3.0), stepdown=2.0, faces="1")
    assert fx.plan_contour(
        read(parts / "blade.step"), fx.Tool.ball(2.0), stepdown=4.0, faces="1"
    ).cutting.any()
    part = model(parts / "cone.step")
    assert (part.nearest(path.contact[path.cutting]).face == 0).all()
    with pytest.raises(SettingError, match=r"no face is called '9'; there are numbers 1 to 3"):
        fx.plan_contour(parts / "cone.step", fx.Tool.ball(3.0), faces="1,9")


def test_chosen_faces_that_no_pass_touches_are_told(parts):
    path = fx.plan_contour(read(parts / "cone.step"), fx.Tool.ball(3.0), stepdown=2.0, faces="1,2")
    (found,) = (finding for finding in path.findings if finding.code == "faces-left-out")
    assert found.severity == "warning"
    assert "no pass touches face 2, 6 % of the chosen area" in found.message


def test_numbers_lie_on_their_faces_and_are_read_from_outside(parts):
    part = model(parts / "two.step")
    vertices, triangles, _ = number_marks(part)
    corners = vertices[triangles]
    foot = part.nearest(corners.mean(axis=1))
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.sum(outward * foot.normal, axis=1) > 0.0).all()
    assert set(foot.face) == set(range(len(part.faces)))


@pytest.mark.parametrize("name", ["cylinder", "cone", "torus"])
def test_numbers_bend_with_their_faces_and_keep_off_the_borders(name, parts):
    part = model(parts / f"{name}.step")
    vertices, _, colours = number_marks(part)
    size = np.ptp(part.corners.reshape(-1, 3), axis=0).max()
    foot = part.nearest(vertices)
    assert set(foot.face) == set(range(len(part.faces)))
    # Plates lie on the surface, strokes on plates; dark on light.
    inked = colours.max(axis=1) < 0.5
    assert 0.0 < inked.mean() < 1.0
    assert foot.distance[~inked].max() < 0.0011 * size
    assert foot.distance[inked].max() < 0.0021 * size
    assert foot.distance[inked].min() > foot.distance[~inked].max()
    high = np.ptp(vertices[inked].reshape(-1, 4, 3), axis=1).max(axis=1).max()
    assert high > 0.01 * size


@pytest.mark.slow
def test_an_assembly_has_its_bodies_where_it_places_them(parts):
    part = model(parts / "assembly_inch.step")
    assert part.bodies == {1: "pin", 2: "pin", 3: "block"}
    assert [face.number for face in part.faces] == list(range(1, 13))
    first, second, block = (part.corners[[part.faces[i].body == b for i in part.owner]] for b in (1, 2, 3))
    assert first.min(axis=(0, 1)) == pytest.approx([95.0, -20.0, -5.0], abs=0.05)
    assert second.min(axis=(0, 1)) == pytest.approx([95.0, -5.0, 50.0], abs=0.05)
    assert block.max(axis=(0, 1)) == pytest.approx([10.0, 20.0, 30.0])
    colours = [face.colour for face in part.faces]
    assert colours == ["#ff0000"] * 6 + ["#0000ff"] + [""] * 5
    assert [face.layer for face in part.faces] == [""] * 6 + ["finish"] + [""] * 5
    alone = model(parts / "assembly_inch.step", body="block")
    assert [face.number for face in alone.faces] == list(range(7, 13))
    with pytest.raises(MeshError, match="'pin' is the name of bodies 1 and 2; give the number"):
        load_mesh(parts / "assembly_inch.step", body="pin")
    with pytest.raises(MeshError, match="no body 'vice'; there are 1 'pin', 2 'pin', 3 'block'"):
        load_mesh(parts / "assembly_inch.step", body="vice")


@pytest.mark.slow
def test_bodies_that_meet_are_no_part_and_others_are(parts):
    assert read(parts / "two.step").is_watertight
    with pytest.raises(MeshError, match=r"bodies 1 .* and 2 .* touch or reach into each other"):
        load_mesh(parts / "meeting.step")
    assert load_mesh(parts / "inside_out.step").volume == pytest.approx(6000.0)


@pytest.mark.slow
def test_the_unit_is_the_files_or_asked_for(parts):
    with pytest.raises(MeshError, match="states no unit; say which it is"):
        load_mesh(parts / "unitless.step")
    assert load_mesh(parts / "unitless.step", unit="inch", mesh_tolerance=0.3).extents[2] == pytest.approx(
        25.4 * 35.0, rel=1e-3
    )
    with pytest.raises(MeshError, match="is in millimetre, as it states itself, and unit = inch"):
        load_mesh(parts / "two.step", unit="inch")


@pytest.mark.slow
def test_surfaces_without_edges_in_common_are_sewn(parts):
    assert load_mesh(parts / "two.iges").volume == pytest.approx(read(parts / "two.step").volume, rel=1e-3)


def test_an_open_shell_is_taken_only_when_allowed(parts):
    with pytest.raises(MeshError, match="not watertight"):
        load_mesh(parts / "swept.step", body="2")
    assert not load_mesh(parts / "swept.step", body="2", allow_open=True).is_watertight


# Each is read in a process of its own.
BROKEN = [pytest.param(n, marks=pytest.mark.slow) for n in ("empty", "text", "no_data", "no_end", "letters")]


@pytest.mark.parametrize("name", ["half", "knots", "references", "shuffled", *BROKEN])
def test_a_damaged_file_is_one_clear_error(parts, name):
    path = parts / f"broken_{name}.step"
    with pytest.raises(MeshError, match="export it again") as caught:
        load_mesh(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_file_that_open_cascade_never_ends_on_is_ended(parts):
    begun = time.monotonic()
    with pytest.raises(MeshError, match="isn't read within 2 s"):
        loading.load_model(parts / "broken_endless.step", seconds=2.0)
    assert time.monotonic() - begun < 30.0


def test_memory_is_limited_and_said(parts, monkeypatch):
    monkeypatch.setattr(loading, "MEMORY", 150 << 20)
    with pytest.raises(MeshError, match=r"takes more than 0 GB of memory|Open Cascade failed"):
        loading.load_model(parts / "blade.step", mesh_tolerance=0.02)


def test_wires_and_too_many_faces_are_refused(parts, tmp_path):
    with pytest.raises(MeshError, match="holds no faces"):
        load_mesh(parts / "wire.step")
    many = tmp_path / "many.step"
    many.write_bytes(b"#1 = ADVANCED_FACE('',(#2),#3,.T.);\n" * 100_001)
    with pytest.raises(MeshError, match="has 100,001 faces, more than the 100,000"):
        load_mesh(many)


def test_without_open_cascade_the_error_says_how_to_install_it(parts, tmp_path, monkeypatch):
    # A copy: what this process has read before needs no library.
    copied = shutil.copy(parts / "two.step", tmp_path)
    monkeypatch.setattr(loading, "find_spec", lambda name: None)
    with pytest.raises(MissingDependency, match=r"pip install 'fiveaxis\[step\]'"):
        load_mesh(copied)


def test_a_mesh_keeps_its_model_until_its_triangles_are_turned(parts):
    mesh = read(parts / "cone.step")
    own = mesh.model
    assert check_mesh(mesh, name="part").model is own
    assert pickle.loads(pickle.dumps(mesh)).model.deviation == own.deviation
    inside_out = Mesh(mesh.vertices, mesh.faces[:, ::-1], own)
    assert check_mesh(inside_out, name="part").model is None


def test_the_survey_finds_hollows_and_overhangs(parts):
    (ring,) = survey(model(parts / "torus.step"))
    assert ring.hollow == pytest.approx(8.0, rel=1e-2)
    assert ring.takes(7.9)
    assert not ring.takes(8.5)
    assert ring.overhang == pytest.approx(0.5, abs=0.02)
    wall, _, bottom = sorted(survey(model(parts / "cone.step")), key=lambda sheet: -sheet.face.area)
    assert wall.overhang == bottom.spread == 0.0
    assert wall.hollow == np.inf


def test_a_gouge_that_the_mesh_would_hide_is_found(parts):
    mesh = load_mesh(parts / "sphere.step", mesh_tolerance=0.2)
    tool, down = fx.Tool.ball(6.0), np.array([[0.0, 0.0, -1.0]])
    rng = np.random.default_rng(4)
    normal = rng.normal(size=(200, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tips = (10.0 + 3.0 - 0.015) * normal - 3.0 * -down
    body = CuttingBody.of(tool)
    axes, floors = np.tile(-down, (200, 1)), np.full(200, -1.0)
    depths = PartDepths.of(body, mesh, Tolerances()).measure(tips, axes, floors)
    assert depths == pytest.approx(np.full(200, 0.015), abs=1e-9)
    bare = Mesh(mesh.vertices, mesh.faces)
    assert (PartDepths.of(body, bare, Tolerances()).measure(tips, axes, floors) < 0.01).mean() > 0.5


def on_sphere(rng, count):
    normal = rng.normal(size=(count, 3))
    normal[: count // 4, :2] *= 0.05  # at the poles
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return 10.0 * normal, normal


def on_torus(rng, count):
    turn, rise = rng.uniform(0.0, 6.28, count), rng.uniform(-1.2, 1.2, count)
    out = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    normal = np.cos(rise)[:, None] * out + np.sin(rise)[:, None] * [0.0, 0.0, 1.0]
    return 12.0 * out + 4.0 * normal, normal


def on_cylinder(rng, count):
    turn, height = rng.uniform(0.0, 6.28, count), rng.uniform(8.0, 12.0, count)
    normal = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    return 5.0 * normal + height[:, None] * [0.0, 0.0, 1.0], normal


ON = {"sphere": on_sphere, "torus": on_torus, "cylinder": on_cylinder}


def leaning_into(form, tool, sunk, count=100, low=0.3, high=0.7):
    """Contacts, tips and axes of a cutter that leans at random, sunk into a surface by a known depth."""
    rng = np.random.default_rng(11)
    on, normal = form(rng, count)
    aside = np.cross(normal, rng.normal(size=(count, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    lean = rng.uniform(low, high, count)[:, None]
    axes = np.cos(lean) * normal + np.sin(lean) * aside
    zone = tool.cutter.zone_for(low, high)
    return on, zone.tip(zone.pivot(on - sunk * normal, normal), normal, axes), axes


@pytest.mark.parametrize("name", ON)
@pytest.mark.parametrize("text", ["bull:10:2", "taper:4:5:10", "barrel:16:85:3"])
def test_planted_gouges_of_leaning_cutters_are_as_deep_as_planted(parts, name, text):
    mesh, tool = read(parts / f"{name}.step", mesh_tolerance=0.1), parse_tool(text)
    body, depths = CuttingBody.of(tool), PartDepths.of(CuttingBody.of(tool), mesh, Tolerances())
    for sunk in (0.012, 0.03):
        _, tips, axes = leaning_into(ON[name], tool, sunk)
        found = depths.measure(tips, axes, np.full(len(tips), -1.0))
        assert found == pytest.approx(np.full(len(tips), sunk), abs=1.1e-4)
    flat = body.depths(tips, axes, tree_of(mesh), np.full(len(tips), -1.0))
    assert flat.min() < 0.015


@pytest.mark.parametrize("name", ON)
def test_a_sharp_edge_sinks_as_deep_as_the_deepest_of_many_points_of_the_surface(parts, name):
    mesh, tool = read(parts / f"{name}.step", mesh_tolerance=0.1), parse_tool("flat:6")
    on, tips, axes = leaning_into(ON[name], tool, 0.015, count=8)
    found = PartDepths.of(CuttingBody.of(tool), mesh, Tolerances()).measure(tips, axes, np.full(8, -1.0))
    part = mesh.model
    wall = max(range(len(part.faces)), key=lambda face: part.faces[face].area)
    uv = part.nearest(on, np.full(8, wall)).uv
    for k in range(8):
        size = np.linalg.norm(part.evaluate(wall, uv[k : k + 1])[0, 1:3], axis=1)
        steps = np.linspace(-0.7, 0.7, 701)
        grid = uv[k] + np.stack(np.meshgrid(*(steps / np.maximum(size, 0.3)[:, None])), axis=-1).reshape(
            -1, 2
        )
        away = part.evaluate(wall, grid)[:, 0] - tips[k]
        height = away @ axes[k]
        rho = np.sqrt(np.maximum(np.sum(away**2, axis=1) - height**2, 0.0))
        most = np.minimum(3.0 - rho, height).max()
        # How far apart points are, and the accuracy.
        assert most - 1e-4 <= found[k] + 1e-9 <= most + 2e-3


@pytest.mark.slow
def test_every_call_that_takes_a_part_takes_a_body_of_its_file(parts, hayashi):
    two, taken = parts / "two.step", {"body": "2", "mesh_tolerance": 0.05}
    path = fx.plan_contour(two, fx.Tool.ball(6), stepdown=7.0, spacing=4.0, faces="7", **taken)
    assert path.contact[path.cutting][:, 0].min() > 44.0
    solution = fx.optimise(path, hayashi, tilt=(15, 75), part=two, effort="quick", crease=20.0, **taken)
    part = solution.surroundings.part.model
    assert [face.kind for face in part.faces] == ["sphere"]
    assert part.deviation > model(two, body="2").deviation
    report = fx.verify(solution.motion, solution.machine, path, part=two, tilt=(15, 75), **taken)
    assert report.figures["gouge_depth_mm"] == solution.verify().figures["gouge_depth_mm"] < 0.01
    axes = tool_poses(solution.machine, solution.motion.positions)[1]
    leaned = replace(solution.toolpath, axis=axes)
    found = fx.find_contacts(leaned, two, **taken)
    radii = np.linalg.norm(found.contact[found.cutting] - [50.0, 0.0, 0.0], axis=1)
    assert np.abs(radii - 5.0).max() < 1e-5
    assert path_quality(path, two, PlanOptions(**taken)).part_size == pytest.approx(
        [10.0, 10.0, 10.0], abs=0.2
    )
    for call in (
        lambda: fx.optimise(path, hayashi, tilt=(15, 75), part=two, body="3"),
        lambda: fx.verify(solution.motion, solution.machine, path, part=two, body="3"),
        lambda: fx.verify_program("any.nc", hayashi, tool=path.tool, part=two, body="3"),
        lambda: write_preview(solution, parts / "page.html", part=two, cad=CadFile(body="3")),
        lambda: fx.find_contacts(leaned, two, body="3"),
    ):
        with pytest.raises(MeshError, match="has no body '3'; there are 1"):
            call()
