"""The pairs of bodies that are checked."""

from dataclasses import replace

import pytest
import trimesh

from fiveaxis.base.errors import MeshError
from fiveaxis.check import Clearances, Fixture, Surroundings
from fiveaxis.check.collision.scene import Scene, build_scene, choose_pairs, describe
from fiveaxis.model import Body, Box, Cylinder, Machine, MeshShape, Tool
from fiveaxis.model.toolpath.tool import Holder, Section

TOOL = Tool.ball(6, shank_diameter=6.0, holder=Holder(30.0, (Section(40.0, 30.0),)))
CLAMP = Fixture("clamp", Box((10.0, 10.0, 10.0), (60.0, 0.0, 5.0)))
BODIES = (
    Body("C", Cylinder(50.0, 18.0, (0.0, 0.0, -9.0))),
    Body("A", Box((120.0, 80.0, 10.0), (0.0, 0.0, -23.0))),
    Body("bed", Box((400.0, 400.0, 10.0), (0.0, 0.0, -300.0))),
    Body("Z", Cylinder(30.0, 80.0, (0.0, 0.0, 60.0))),
)


def surroundings() -> Surroundings:
    part = trimesh.creation.box(extents=(20.0, 20.0, 20.0))
    stock = trimesh.creation.box(extents=(30.0, 30.0, 30.0))
    return Surroundings(part, stock, (CLAMP,))


def names(machine: Machine, tool: Tool = TOOL) -> set[tuple[str, str, str]]:
    pairs, _ = choose_pairs(build_scene(machine, tool, surroundings()), Clearances())
    return {(p.kind, p.first.name, p.second.name) for p in pairs}


def sentences(scene: Scene) -> list[str]:
    return [gap.sentence for gap in scene.not_checked]


@pytest.fixture
def bodied() -> Machine:
    return replace(Machine.from_code("640123"), bodies=BODIES).with_tool_length(100.0)


def test_the_cutter_may_touch_the_part_and_nothing_else_may(bodied):
    found = names(bodied)
    assert ("cutter", "cutter", "part") not in found
    against = {"part", "stock", "fixture 'clamp'", *(f"machine body {i}" for i in (1, 2, 3))}
    for kind in ("shank", "holder"):
        others = {other.split(" on ")[0] for k, _, other in found if k == kind}
        assert others == against
    cutter = {other.split(" on ")[0] for k, _, other in found if k == "cutter"}
    assert cutter == against - {"part"}


def test_the_cutter_meets_the_stock_in_rapid_moves_only(bodied):
    pairs, _ = choose_pairs(build_scene(bodied, TOOL, surroundings()), Clearances())
    assert [(p.first.name, p.second.name) for p in pairs if p.rapid_only] == [("cutter", "stock")]


def test_bodies_of_one_link_are_not_checked_against_each_other(bodied):
    spindle = "machine body 4 on link Z"
    table = "machine body 1 on link C"
    for _, first, second in names(bodied):
        assert {first, second} not in [{spindle, "holder"}, {table, "part"}, {table, "fixture 'clamp'"}]


def test_neighbours_that_touch_at_home_are_left_out_and_reported(bodied):
    pairs, left_out = choose_pairs(build_scene(bodied, TOOL, surroundings()), Clearances())
    pairs = {(p.first.name, p.second.name) for p in pairs}
    assert ("machine body 2 on link A", "machine body 1 on link C") not in pairs
    assert ("machine body 4 on link Z", "machine body 1 on link C") in pairs
    assert [gap.sentence.split(":")[0] for gap in left_out] == [
        "machine body 2 on link A against machine body 1 on link C",
        "rapid moves of the cutter out of the stock, within 10 mm or back along the tool's axis",
    ]


def test_a_part_that_overlaps_a_neighbouring_link_is_checked(bodied):
    deep = replace(bodied, bodies=(Body("A", Box((120.0, 80.0, 10.0))),))
    assert ("machine", "machine body 1 on link A", "part") in names(deep)


def test_a_head_of_unknown_tool_length_is_left_out_and_reported(bodied):
    scene = build_scene(bodied.with_tool_length(0.0), TOOL, surroundings())
    assert "machine body 4 on link Z" not in [b.name for b in scene.bodies]
    assert any("tool_length" in sentence for sentence in sentences(scene))


def test_what_a_tool_does_not_state_is_reported(bodied):
    scene = build_scene(bodied, Tool.ball(6), surroundings())
    assert sentences(scene)[:2] == [
        "cutting edges above 6 mm: the tool states no cutting length",
        "shank and holder against anything: the tool states no holder",
    ]
    bare = build_scene(bodied, Tool.ball(6, holder=TOOL.holder), surroundings())
    assert "shank" in {body.name for body in bare.bodies}
    assert "shank diameter: not stated" in sentences(bare)[1]


def test_a_sentence_names_each_body_with_its_clearance(bodied):
    pairs, _ = choose_pairs(build_scene(bodied, TOOL, surroundings()), Clearances(holder=1.5))
    (sentence,) = [s for s in describe(pairs) if s.startswith("holder ")]
    assert "part, stock, fixture 'clamp', machine body 1 on link C" in sentence
    assert sentence.endswith("clearance 1.5 mm")


def test_the_shanks_sentence_states_where_its_clearance_to_the_cut_begins(bodied):
    pairs, _ = choose_pairs(build_scene(bodied, TOOL, surroundings()), Clearances())
    (sentence,) = [s for s in describe(pairs) if s.startswith("shank ")]
    assert sentence.endswith("clearance 0.2 mm, to part and stock from half its diameter above the cutter")


def test_a_clamped_axis_leaves_no_bodies_and_that_is_reported(bodied):
    scene = build_scene(bodied.holding("C", 0.0), TOOL, surroundings())
    assert "bodies of the machine: they aren't known while an axis is clamped" in sentences(scene)


def test_an_open_mesh_is_reported(bodied):
    part = trimesh.creation.box(extents=(20.0, 20.0, 20.0))
    part.update_faces([True] * 11 + [False])
    scene = build_scene(bodied, TOOL, Surroundings(part))
    assert "whether a body lies wholly inside the part: its mesh isn't watertight" in sentences(scene)


def test_a_fixtures_mesh_that_is_inside_out_is_refused(bodied, tmp_path):
    jaw = trimesh.creation.box(extents=(20.0, 20.0, 20.0))
    jaw.invert()
    jaw.export(tmp_path / "jaw.stl")
    fixtures = (Fixture("jaw", MeshShape(tmp_path / "jaw.stl")),)
    with pytest.raises(MeshError, match=r"jaw\.stl: its normals point into the material"):
        build_scene(bodied, TOOL, Surroundings(fixtures=fixtures))


def test_a_mesh_of_many_triangles_is_accepted_and_its_memory_reported(bodied, monkeypatch):
    monkeypatch.setattr("fiveaxis.check.collision.scene.MANY_TRIANGLES", 1000)
    part = trimesh.creation.icosphere(subdivisions=4)
    (sentence,) = build_scene(bodied, TOOL, Surroundings(part)).checked
    assert sentence == "part: 5,120 triangles, 1 MiB of memory"
