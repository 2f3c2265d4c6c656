"""Rooms import from lower rooms only, and heavy libraries only where the design has them."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "fiveaxis"
LAYER = {
    "errors": 0, "findings": 0,
    "codes": 1, "files": 1, "geometry": 1, "settings": 1,
    "machine": 2, "mesh": 2, "toolpath": 2,
    "kinematics": 3, "contour": 3,
    "motion": 4,
    "collision": 5, "energy": 5, "nc": 5,
    "posture": 6,
    "verification": 7, "report": 7, "viewer": 7,
    "job": 8,
    "batch": 9,
    "cli": 10,
}  # fmt: skip
ALLOWED = {
    "casadi": {"kinematics/symbolic.py", "posture/tape.py", "posture/terms.py", "posture/local/ipopt.py"},
    "coal": {"collision", "verification"},
    "pinocchio": {"verification", "viewer"},
    "trimesh": {"collision", "mesh"},
    "meshcat": {"viewer"},
    "matplotlib": {"report"},
    "numba": {"collision", "mesh", "motion", "posture"},
    "typer": {"cli"},
    "dask": {"batch"},
    "distributed": {"batch"},
}
MODULES = sorted(PACKAGE.rglob("*.py"))


def walk(node: ast.AST) -> Iterator[ast.AST]:
    """Every node that runs: what only a type checker reads isn't an import."""
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield node
    for child in ast.iter_child_nodes(node):
        yield from walk(child)


def imports(path: Path) -> Iterator[str]:
    for node in walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: relative import"
            yield node.module


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_room_imports_lower_rooms_only(path):
    mine = room_of(path)
    if mine == "__init__":
        return
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "fiveaxis" and len(parts) > 1 and parts[1] != mine:
            assert LAYER[parts[1]] < LAYER[mine], f"{mine} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_stay_in_their_rooms(path):
    here = path.relative_to(PACKAGE)
    for name in imports(path):
        homes = ALLOWED.get(name.split(".")[0])
        if homes is not None:
            assert here.as_posix() in homes or here.parts[0] in homes, f"{here} imports {name}"


def test_every_room_has_its_number():
    assert {room_of(p) for p in MODULES} - {"__init__"} == set(LAYER)
