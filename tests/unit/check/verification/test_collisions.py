"""Collisions at known angles, within moves, and between the machine's own bodies."""

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.sampled_surfaces import FAR_HEAD

from fiveaxis.base.findings import Severity
from fiveaxis.check import Clearances, Fixture, Surroundings, Tolerances
from fiveaxis.check.verification.check_context import CheckContext, make_context
from fiveaxis.check.verification.collisions import check_collisions
from fiveaxis.check.verification.model import link_poses as verified_poses
from fiveaxis.check.verification.report import Result, make_report
from fiveaxis.model import (
    Body,
    Box,
    Cylinder,
    Machine,
    MeshShape,
    Motion,
    MoveKind,
    Tool,
    Toolpath,
    link_poses,
)
from fiveaxis.model.toolpath.tool import Holder, Section

TOUCHING_ONLY = Clearances(0.0, 0.0, 0.0, 0.0)
SHANK, STICK_OUT, HOLDER, TOP = 3.0, 40.0, 20.0, 80.0
TOOL = Tool.ball(
    6, shank_diameter=2.0 * SHANK, holder=Holder(STICK_OUT, (Section(TOP - STICK_OUT, 2.0 * HOLDER),))
)
MICROMETRE = 1e-3
# mm, how exact depths of round bodies are.
DEPTH = 5e-5
# By which part of its radius a ball's polygon lies outside of it.
AROUND = 5.4e-4


@pytest.fixture(scope="module")
def table_table() -> Machine:
    """X Y Z carry the upright tool, A and then C turn the part: tip and axis values follow simply."""
    return Machine.from_code("640123")


def context_of(machine: Machine, rows, kind=MoveKind.CUT, tool: Tool = TOOL) -> CheckContext:
    """Build a motion from axis values X Y Z in mm, A C in degrees, with its path."""
    positions = np.array(rows, dtype=float) * [1.0, 1.0, 1.0, np.pi / 180.0, np.pi / 180.0]
    n = len(positions)
    kinds = np.full(n, kind)
    path = Toolpath.from_tips(np.zeros((n, 3)), np.tile([0.0, 0.0, 1.0], (n, 1)), tool, kind=kinds)
    motion = Motion(machine.letters, positions, path.feed, np.ones(n), kinds, path.source)
    return make_context(motion, machine, path, None, Tolerances())


def wall(x: float) -> trimesh.Trimesh:
    """A closed wall whose face at x looks towards −x."""
    box = trimesh.creation.box(extents=(10.0, 400.0, 400.0))
    box.apply_translation((x + 5.0, 0.0, 0.0))
    return box


def check(context: CheckContext, **kinds) -> dict[str, Result]:
    found = check_collisions(context, Surroundings(**kinds))
    return {result.code: result for result in found if len(result.rows)}


def leaning_to_x(degrees: float) -> list[float]:
    """The tool leans towards +x: A leans it in the plane of y and z, and C turns that lean."""
    return [0.0, 0.0, 0.0, degrees, 0.0]


@pytest.mark.parametrize("as_box", [False, True])
def test_a_holder_meets_a_wall_beyond_the_analytic_angle(table_table, as_box):
    """The holder's upper rim is ``TOP·sin θ + HOLDER·cos θ`` from the tip: 50 mm at θ = arcsin … − atan …"""
    distance = 50.0
    edge = np.degrees(np.arcsin(distance / np.hypot(TOP, HOLDER)) - np.arctan2(HOLDER, TOP))
    axis = verified_poses(table_table)(np.radians([leaning_to_x(10.0)]))["Z"][0, :3, 2]
    side = axis * [1.0, 1.0, 0.0] / np.linalg.norm(axis[:2])
    mesh = wall(distance)
    turn = np.eye(4)
    turn[:3, :2] = np.column_stack([side, np.cross([0.0, 0.0, 1.0], side)])
    mesh.apply_transform(turn)
    angle = np.arctan2(side[1], side[0])
    assert np.isclose(abs(angle), np.pi / 2.0)  # so a box along the axes can be that wall
    box = Box((400.0, 10.0, 400.0), tuple((distance + 5.0) * side))
    bodies = {"fixtures": (Fixture("wall", box),)} if as_box else {"part": mesh}
    for off, hits in ((-0.05, False), (0.05, True)):
        context = context_of(table_table, [leaning_to_x(edge + off)])
        assert ("holder-collision" in check(context, clearances=TOUCHING_ONLY, **bodies)) is hits


def test_a_ball_in_a_bore_has_the_expected_clearance(table_table, tmp_path):
    ring = trimesh.creation.annulus(r_min=10.0, r_max=30.0, height=40.0, sections=720)
    tool = Tool.ball(8)
    context = context_of(table_table, [[x, 0.0, 0.0, 0.0, 0.0] for x in (0.0, 5.5, 5.99, 6.01)], tool=tool)
    ring.export(tmp_path / "jaw.ply")
    jaw = Fixture("jaw", MeshShape(tmp_path / "jaw.ply"))
    found = check(context, fixtures=(jaw,), clearances=Clearances(cutter=0.6))
    assert found["fixture-collision"].rows.tolist() == [3]
    assert found["fixture-collision"].values[0] == pytest.approx(0.01, abs=4.0 * AROUND)
    near = found["fixture-clearance"]
    assert near.rows.tolist() == [1, 2]
    np.testing.assert_allclose(0.6 - near.values, [0.5, 0.01], atol=0.01)


@pytest.mark.parametrize(("gap", "hits"), [(MICROMETRE, False), (-MICROMETRE, True)])
@pytest.mark.parametrize("as_box", [False, True])
def test_a_micrometre_decides_while_the_shank_grazes_a_wall(table_table, gap, hits, as_box):
    rows = [[0.0, y, 0.0, 0.0, 0.0] for y in (-0.2, 0.0, 0.2)]
    at = SHANK + gap
    bodies = (
        {"fixtures": (Fixture("wall", Box((10.0, 400.0, 60.0), (at + 5.0, 0.0, 0.0))),)}
        if as_box
        else {"part": trimesh.creation.box(bounds=[[at, -200.0, -30.0], [at + 10.0, 200.0, 30.0]])}
    )
    found = check(context_of(table_table, rows), clearances=TOUCHING_ONLY, **bodies)
    assert ("shank-collision" in found) is hits
    if hits:
        assert found["shank-collision"].rows.tolist() == [0, 1, 2]
        np.testing.assert_allclose(found["shank-collision"].values, MICROMETRE, atol=DEPTH)


def test_a_turn_that_is_clear_at_both_ends_collides_in_the_middle(table_table):
    """The table turns half a turn under the tool, 60 mm off its axis; a clamp passes halfway."""
    clamp = Fixture("clamp", Box((10.0, 10.0, 200.0), (0.0, 60.0, 0.0)))
    ends = [[60.0, 0.0, 0.0, 0.0, c] for c in (0.0, 180.0)]
    there = link_poses(table_table, np.array([[60.0, 0.0, 0.0, 0.0, np.pi / 2.0]]))["Z"]
    side = np.sign(there[0, 1, 3])
    clamp = replace(clamp, shape=replace(clamp.shape, center=(0.0, 60.0 * side, 0.0)))
    for end in ends:
        assert check(context_of(table_table, [end]), fixtures=(clamp,)) == {}
    found = check(context_of(table_table, ends), fixtures=(clamp,))
    assert found["fixture-collision"].rows.tolist() == [1]
    assert "in the move to here" in found["fixture-collision"].message(0)
    far = replace(clamp, shape=replace(clamp.shape, center=(0.0, -60.0 * side, 0.0)))
    assert check(context_of(table_table, ends), fixtures=(far,)) == {}


def test_a_thin_pin_between_two_locations_is_not_missed(table_table):
    pin = Fixture("pin", Cylinder(0.05, 10.0, (37.3, 0.0, 0.0)))
    rows = [[0.0, 0.0, 0.0, 0.0, 0.0], [100.0, 0.0, 0.0, 0.0, 0.0]]
    found = check(context_of(table_table, rows, MoveKind.RAPID), fixtures=(pin,))
    assert found["fixture-collision"].rows.tolist() == [1]


def test_only_the_holder_is_named_if_only_the_holder_collides(table_table):
    shelf = trimesh.creation.box(bounds=[[10.0, -20.0, 50.0], [60.0, 20.0, 60.0]])
    found = check(context_of(table_table, [[0.0] * 5]), part=shelf)
    assert set(found) == {"holder-collision"}
    assert "the holder reaches" in found["holder-collision"].message(0)
    assert "into the part here" in found["holder-collision"].message(0)


def test_a_clamp_is_named_with_the_depth(table_table):
    clamp = Fixture("left clamp", Box((20.0, 20.0, 20.0), (12.0, 0.0, 15.0)))
    found = check(context_of(table_table, [[0.0] * 5]), fixtures=(clamp,))
    assert set(found) == {"shank-collision", "fixture-collision"}
    assert "fixture 'left clamp'" in found["shank-collision"].message(0)
    assert found["shank-collision"].values[0] == pytest.approx(1.0, abs=1e-4)


# How exactly the movement that parts two bodies is known, as a share of it, and mm by the step along a move.
PARTING, STEP = 2e-3, 0.1
CROSSING = [[-60.0, 0.3, -15.0, 0.0, 0.0], [60.0, 0.3, -15.0, 0.0, 0.0]]


def depth_in(machine: Machine, shape: Box | trimesh.Trimesh, rows, folder) -> float:
    """Depth of a flat cutter of 10 mm in a fixture, mm; a mesh is read from its file."""
    if isinstance(shape, trimesh.Trimesh):
        shape.export(folder / "fixture.stl")
        shape = MeshShape(folder / "fixture.stl")
    found = check(context_of(machine, rows, tool=Tool.flat(10)), fixtures=(Fixture("clamp", shape),))
    return float(found["fixture-collision"].values[0])


@pytest.mark.parametrize("divided", [0, 3], ids=["12 triangles", "768 triangles"])
@pytest.mark.parametrize(
    ("size", "rows", "depth"),
    [
        ((40.0, 40.0, 40.0), CROSSING, 15.0),  # up, out of the middle of it
        ((20.0, 20.0, 40.0), CROSSING, 14.7),  # aside, to the nearer wall
        ((60.0, 60.0, 36.0), [[0.0, 0.0, z, 0.0, 0.0] for z in (20.0, -40.0)], 20.5),  # up or down
        ((40.0, 40.0, 40.0), [[-24.0, 0.3, -15.0, 0.0, 0.0]], 1.0),
        ((40.0, 40.0, 40.0), [[24.0, 0.3, -15.0, 0.0, 0.0], [40.0, 0.3, -15.0, 0.0, 0.0]], 1.0),
    ],
    ids=["block", "post", "plunge", "side", "leaving"],
)
def test_a_mesh_is_as_deep_as_the_box_that_it_is(table_table, tmp_path, size, rows, depth, divided):
    """Triangles in the middle of the cutter are at most as deep as they are wide."""
    bounds = [[-size[0] / 2, -size[1] / 2, -size[2]], [size[0] / 2, size[1] / 2, 0.0]]
    mesh = trimesh.creation.box(bounds=bounds)
    for _ in range(divided):
        mesh = mesh.subdivide()
    for shape in (Box(size, (0.0, 0.0, -size[2] / 2.0)), mesh):
        assert depth - STEP <= depth_in(table_table, shape, rows, tmp_path) <= depth * (1.0 + PARTING)


def test_a_cutter_between_two_walls_is_as_deep_as_in_the_nearer_one(table_table, tmp_path):
    walls = [[[-30.0, -30.0, -40.0], [-10.0, 30.0, 10.0]], [[10.0, -30.0, -40.0], [30.0, 30.0, 10.0]]]
    vice = trimesh.util.concatenate([trimesh.creation.box(bounds=bounds) for bounds in walls])
    found = depth_in(table_table, vice, [[5.1, 0.0, -30.0, 0.0, 0.0]], tmp_path)
    assert found == pytest.approx(0.1, abs=1e-3)


def test_a_slanted_wall_is_left_along_its_normal(table_table, tmp_path):
    """The lowest point of the cutter's bottom is at its rim, 1.5 mm under the wall's face."""
    normal = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    block = trimesh.creation.box((100.0, 100.0, 100.0))
    block.apply_transform(trimesh.geometry.align_vectors([0.0, 0.0, 1.0], normal))
    block.apply_translation(-50.0 * normal)
    tip = normal * (5.0 * np.hypot(*normal[:2]) - 1.5)
    found = depth_in(table_table, block, [[*tip, 0.0, 0.0]], tmp_path)
    assert 1.5 - DEPTH <= found <= 1.5 * (1.0 + PARTING)


def test_the_whole_shank_stays_clear_of_a_fixture(table_table):
    clamp = Fixture("clamp", Box((10.0, 10.0, 10.0), (SHANK + 5.1, 0.0, 0.9)))
    assert "shank-clearance" in check(context_of(table_table, [[0.0] * 5]), fixtures=(clamp,))


def test_too_near_is_a_warning_with_the_remaining_clearance(table_table):
    shelf = trimesh.creation.box(bounds=[[20.7, -20.0, 50.0], [60.0, 20.0, 60.0]])
    found = check(context_of(table_table, [[0.0] * 5]), part=shelf, clearances=Clearances(holder=1.0))
    (result,) = found.values()
    assert (result.code, result.severity) == ("holder-clearance", Severity.WARNING)
    assert result.values[0] == pytest.approx(0.3, abs=0.011)
    assert "(clearance 1 mm)" in result.message(0)


@pytest.mark.parametrize(
    ("gap", "top", "code"), [(0.1, 5.7, None), (0.1, 6.1, "clearance"), (-0.1, 5.7, "collision")]
)
def test_just_above_the_cutter_the_shank_may_be_as_near_as_the_cut(table_table, gap, top, code):
    """The shank begins 3 mm above the tip; from 6 mm on, which is its radius higher, it needs clearance."""
    ledge = trimesh.creation.box(bounds=[[SHANK + gap, -20.0, -20.0], [60.0, 20.0, top]])
    found = check(context_of(table_table, [[0.0] * 5]), part=ledge)
    assert set(found) == (set() if code is None else {f"shank-{code}"})


def test_a_tool_wholly_inside_the_part_is_found(table_table):
    block = trimesh.creation.box(extents=(300.0, 300.0, 300.0))
    rows = [[float(x), 0.0, 0.0, 0.0, 0.0] for x in range(5)]
    found = check(context_of(table_table, rows), part=block)
    assert found["holder-collision"].rows.tolist() == [0, 1, 2, 3, 4]
    assert np.isinf(found["holder-collision"].values).all()
    assert "wholly inside" in found["shank-collision"].message(0)
    assert found["shank-collision"].figures == {"shank_overlap_mm": None}, "unknown is never 0"


def test_a_head_meets_a_trunnion_that_has_turned(table_table):
    cheek = Body("A", Box((10.0, 80.0, 120.0), (70.0, 0.0, 0.0)))
    head = Body("Z", Cylinder(60.0, 100.0, (0.0, 0.0, 50.0)))
    machine = replace(table_table, bodies=(cheek, head)).with_tool_length(90.0)
    upright = context_of(machine, [[0.0] * 5], tool=Tool.ball(6))
    assert check(upright) == {}
    for x, hits in ((4.0, False), (6.0, True)):
        aside = context_of(machine, [[x, 0.0, -35.0, 0.0, 0.0]], tool=Tool.ball(6))
        assert ("machine-collision" in check(aside, clearances=TOUCHING_ONLY)) is hits


def test_a_trunnion_swings_into_the_head_between_two_locations(table_table):
    arm = Body("A", Box((20.0, 20.0, 60.0), (0.0, -150.0, 0.0)))
    head = Body("Z", Box((200.0, 60.0, 60.0), (0.0, 0.0, 30.0)))
    machine = replace(table_table, bodies=(arm, head)).with_tool_length(100.0)
    rows = [[0.0, 0.0, 100.0, a, 0.0] for a in (-180.0, 180.0)]
    for row in rows:
        assert check(context_of(machine, [row], tool=Tool.ball(6))) == {}
    found = check(context_of(machine, rows, tool=Tool.ball(6)))
    assert found["machine-collision"].rows.tolist() == [1]
    assert "in the move to here" in found["machine-collision"].message(0)


def test_what_no_pair_measures_is_unknown_and_never_0(table_table):
    context = context_of(table_table, [leaning_to_x(0.0), leaning_to_x(1.0)])
    post = Fixture("post", Box((10.0, 10.0, 10.0), (150.0, 0.0, 0.0)))

    def figures(*kinds: str, **bodies) -> set[float | None]:
        found = check_collisions(context, Surroundings(**bodies))
        return {v for r in found for name, v in r.figures.items() if name.split("_")[0] in kinds}

    assert figures("shank", "holder", "fixture", "machine") == {None}
    assert figures("shank", "holder", "fixture", fixtures=(post,)) == {0.0}
    assert figures("machine", fixtures=(post,)) == {0.0}  # the assumed spindle nose
    bodies = Body("C", Box((1.0, 1.0, 1.0), (0.0, 0.0, -1e3))), FAR_HEAD
    context = replace(context, machine=replace(table_table, bodies=bodies))
    assert figures("machine") == {None}  # a head of unknown tool length
    context = replace(context, machine=table_table)
    # The cutter is checked against the stock in rapid moves alone, and here is none.
    stock = wall(150.0)
    assert figures("fixture", stock=stock) == {None}
    assert figures("shank", stock=stock) == {0.0}


def test_bodies_far_away_need_no_queries(table_table, caplog):
    far = trimesh.creation.box(bounds=[[500.0] * 3, [600.0] * 3])
    rows = [[x, 0.0, 0.0, 0.0, 0.0] for x in np.linspace(0.0, 50.0, 300)]
    with caplog.at_level("INFO", logger="fiveaxis.check.verification.collisions"):
        assert check(context_of(table_table, rows), part=far) == {}
    assert re.search(
        r"^3 pairs of bodies along 300 locations: 0 queries, [1-9]\d* stretches", caplog.messages[-1]
    )


@pytest.mark.parametrize(
    ("heights", "kind", "hits"),
    [
        ((30.0, 5.0), MoveKind.RAPID, True),
        ((5.0, 30.0), MoveKind.RAPID, False),
        ((30.0, 5.0), MoveKind.CUT, False),
    ],
)
def test_the_cutter_may_leave_the_stock_in_a_rapid_but_not_enter_it(table_table, heights, kind, hits):
    stock = trimesh.creation.box(extents=(20.0, 20.0, 20.0))
    rows = [[0.0, 0.0, z, 0.0, 0.0] for z in heights]
    found = check(context_of(table_table, rows, [MoveKind.CUT, kind], Tool.ball(6)), stock=stock)
    assert ("fixture-collision" in found) is hits


@pytest.mark.parametrize(
    ("places", "bad"),
    [
        (((-40.0, -5.0), (40.0, -5.0)), [1]),  # through all of the stock
        (((-40.0, -5.0), (-30.0, -5.0), (-20.0, -5.0), (90.0, -5.0)), [2, 3]),  # the same in parts
        (((-40.0, -5.0), (-33.0, -5.0)), [1]),  # ends in it
        (((46.0, -5.0), (90.0, -5.0)), []),  # leaves it after 7 mm
        (((46.0, -5.0), (49.0, -5.0), (90.0, -5.0)), []),
        (((40.0, -5.0), (43.5, -5.0), (47.0, -5.0), (90.0, -5.0)), [3]),  # after 13 mm in three moves
        (((46.0, -5.0), (60.0, -5.0), (40.0, -5.0)), [2]),  # comes back
        (((0.0, -25.0), (0.0, 30.0), (0.0, 40.0)), []),  # back along its axis
        (((0.0, -25.0), (0.0, -24.0), (20.0, -24.0)), [2]),
    ],
)
@pytest.mark.parametrize("sunk", [0.0, 40.0])
def test_a_rapid_that_stays_in_the_stock_is_an_error(table_table, places, bad, sunk):
    """The stock's right face is at 50 mm, its top at 0; sunk, the whole cutter is under it at first."""
    stock = trimesh.creation.box(bounds=[[-60.0, -60.0, -90.0], [50.0, 60.0, 0.0]])
    rows = [[x, 0.0, z - sunk, 0.0, 0.0] for x, z in places]
    if sunk and places[-1][1] > 0.0:
        rows = [[x, 0.0, z - sunk * (z < 0.0), 0.0, 0.0] for x, z in places]
    kinds = [MoveKind.CUT, *[MoveKind.RAPID] * (len(rows) - 1)]
    found = check(context_of(table_table, rows, kinds, Tool.flat(6)), stock=stock)
    assert [r.rows.tolist() for r in found.values()] == ([bad] if bad else [])


def test_a_rapid_that_leaves_the_stock_and_enters_it_again_is_an_error(table_table):
    """Two blocks of one stock with a gap between: 5 mm in the one, then into the other."""
    blocks = [trimesh.creation.box(bounds=[[x, -20.0, -20.0], [x + 20.0, 20.0, 20.0]]) for x in (-20.0, 20.0)]
    stock = trimesh.util.concatenate(blocks)
    rows = [[-2.0, 0.0, 0.0, 0.0, 0.0], [60.0, 0.0, 0.0, 0.0, 0.0]]
    found = check(context_of(table_table, rows, [MoveKind.CUT, MoveKind.RAPID], Tool.flat(6)), stock=stock)
    assert found["fixture-collision"].rows.tolist() == [1]
    out = [[-2.0, 0.0, 0.0, 0.0, 0.0], [10.0, 0.0, 0.0, 0.0, 0.0]]
    assert (
        check(context_of(table_table, out, [MoveKind.CUT, MoveKind.RAPID], Tool.flat(6)), stock=stock) == {}
    )


def test_rows_that_are_not_finite_are_left_out_and_reported(table_table):
    rows = [[0.0] * 5, [np.nan] * 5, [0.0] * 5, [0.0] * 5]
    results = check_collisions(context_of(table_table, rows), Surroundings(part=wall(SHANK - 1.0)))
    report = make_report(results, context_of(table_table, rows).toolpath, ())
    assert [f.place.location for f in report.findings if f.code == "shank-collision"] == [0, 2, 3]
    assert any(s.startswith("collisions at 1 locations") for s in report.not_checked)


def test_a_long_path_is_swept_in_stretches_without_gaps(table_table, monkeypatch):
    rows = [[0.0, float(y), 0.0, 0.0, 0.0] for y in range(30)]
    bodies = {"part": trimesh.creation.box(bounds=[[2.0, 3.5, -5.0], [9.0, 11.5, 30.0]])}
    whole = check(context_of(table_table, rows), **bodies)
    monkeypatch.setattr("fiveaxis.check.verification.collisions.LONGEST_STRETCH", 4)
    parts = check(context_of(table_table, rows), **bodies)
    assert {c: r.rows.tolist() for c, r in whole.items()} == {c: r.rows.tolist() for c, r in parts.items()}
    assert whole["shank-collision"].rows.tolist() == list(range(2, 15))


def test_pairs_that_collide_at_one_location_are_one_finding_on_the_worst(table_table):
    deep = Fixture("deep", Box((10.0, 10.0, 10.0), (6.0, 0.0, 20.0)))
    shallow = Fixture("shallow", Box((10.0, 10.0, 10.0), (-7.5, 0.0, 20.0)))
    result = check(context_of(table_table, [[0.0] * 5]), fixtures=(shallow, deep))["shank-collision"]
    assert result.rows.tolist() == [0]
    assert "'deep'" in result.message(0)
    assert "1 more pair" in result.message(0)


def test_links_are_verified_where_our_equations_place_them(trunnion):
    machine = trunnion.with_setup((1.0, 2.0, 3.0), (10.0, 20.0, 30.0)).with_tool_length(70.0)
    positions = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 5)) * [100.0, 100.0, 100.0, 1.0, 3.0]
    found, expected = verified_poses(machine)(positions), link_poses(machine, positions)
    assert list(found) == list(expected)
    for link in expected:
        np.testing.assert_allclose(found[link], expected[link], atol=1e-9)


def test_a_machine_of_meshes_is_checked_against_a_part_inside_it(table_table, tmp_path):
    """A small part inside a closed mesh is found, though it touches no surface."""
    trimesh.creation.box(extents=(80.0, 80.0, 80.0)).export(tmp_path / "yoke.stl")
    machine = replace(table_table, bodies=(Body("A", MeshShape(tmp_path / "yoke.stl")),))
    part = trimesh.creation.box(extents=(10.0, 10.0, 10.0))
    found = check(context_of(machine, [[0.0, 0.0, 200.0, 0.0, 0.0]], tool=Tool.ball(6)), part=part)
    assert set(found) == {"machine-collision"}
    assert "wholly inside or around the part" in found["machine-collision"].message(0)
