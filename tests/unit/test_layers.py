"""The table of rooms in ARCHITECTURE.md is true: layers, libraries, and no circle of imports."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fiveaxis"
# What every room may import, as ARCHITECTURE.md says.
ANYWHERE = {"fiveaxis", "numpy", "scipy", "pydantic", "pydantic_core", *sys.stdlib_module_names}
# The calls to a higher room, by file, as ARCHITECTURE.md says: imported in the function, when it is called.
UPWARDS = re.compile(r"^One call goes up: `([\w/.]+)` calls `(\w+)`", re.MULTILINE)
ROW = re.compile(r"^\| `(\w+)` \| (\d+) \| [^|]+ \|([^|]*)\|$", re.MULTILINE)
LIBRARY = re.compile(r"(\w+)(?: \(([^)]*)\))?")


class Room(NamedTuple):
    """A row of the table: its layer, and its libraries with the files that may import them, all if none."""

    layer: int
    libraries: dict[str, set[str]]


def read_rooms() -> dict[str, Room]:
    rooms = {}
    for name, layer, cell in ROW.findall((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")):
        libraries = {lib: set(re.findall(r"`([^`]+)`", files)) for lib, files in LIBRARY.findall(cell)}
        rooms[name] = Room(int(layer), libraries)
    return rooms


ROOMS = read_rooms()
(UPWARD,) = UPWARDS.findall((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"))


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


MODULES = [(room_of(path), path) for path in sorted(PACKAGE.rglob("*.py")) if room_of(path) in ROOMS]


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def nodes(node: ast.AST, *, types: bool) -> Iterator[ast.AST]:
    """Every node that runs, with or without what only a type checker reads."""
    if not types and isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield node
    for child in ast.iter_child_nodes(node):
        yield from nodes(child, types=types)


@cache
def imports(path: Path, *, types: bool = False) -> tuple[str, ...]:
    """Names of the modules that a module imports, within functions too."""
    return tuple(find_imports(path, types=types))


def find_imports(path: Path, *, types: bool) -> Iterator[str]:
    for node in nodes(ast.parse(path.read_text(encoding="utf-8")), types=types):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: relative import"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "import_module":
            yield from (str(a.value) for a in node.args if isinstance(a, ast.Constant))


def test_the_table_has_every_room_and_no_other():
    assert set(ROOMS) == {room_of(path) for path in PACKAGE.rglob("*.py")} - {"__init__"}


def test_a_room_imports_lower_rooms_only():
    wrong = []
    for room, path in MODULES:
        for name in imports(path, types=True):
            other = [*name.split("."), ""][1]
            if (path.relative_to(PACKAGE).as_posix(), other) == UPWARD:
                continue
            if name.startswith("fiveaxis.") and other in ROOMS and other != room:
                wrong += [f"{path} imports {name}"] * (ROOMS[other].layer >= ROOMS[room].layer)
    assert wrong == []


def test_what_is_called_upwards_is_imported_when_it_is_called():
    file, room = UPWARD
    tree = ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
    at_once = [ast.unparse(node) for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert f"fiveaxis.{room}" in imports(PACKAGE / file)
    assert not any(f"fiveaxis.{room}" in text for text in at_once)


def test_a_room_imports_its_own_libraries_only_and_needs_each():
    """The table gives a library to a room, or to some of its files; all that import it, and no others."""
    found = set()
    for room, path in MODULES:
        here = "/".join(path.relative_to(PACKAGE).parts[1:])
        for library in {name.split(".")[0] for name in imports(path)} - ANYWHERE:
            found.add((room, library, here if ROOMS[room].libraries.get(library) else ""))
    table = ((room, library, files) for room in ROOMS for library, files in ROOMS[room].libraries.items())
    assert found == {(room, library, file) for room, library, files in table for file in files or {""}}


def test_no_modules_of_a_room_import_each_other_in_a_circle():
    for room in ROOMS:
        names = {name_of(path): set(imports(path)) for r, path in MODULES if r == room}
        graph = {name: (found & set(names)) - {name, f"fiveaxis.{room}"} for name, found in names.items()}
        try:
            TopologicalSorter(graph).prepare()
        except CycleError as circle:
            pytest.fail(" -> ".join(circle.args[1]))


def reached(module: str) -> set[str]:
    """A module of the package, and all that it imports, at once or later."""
    found, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        path = ROOT / f"{name.replace('.', '/')}.py"
        path = path if path.is_file() else path.with_suffix("") / "__init__.py"
        if name not in found and path.is_file():
            found.add(name)
            waiting += [other for other in imports(path) if other.startswith("fiveaxis.")]
    return found


def test_the_check_of_collisions_shares_no_tree_and_no_loop_with_the_mask_of_the_search():
    """Else a fault of one could hide in the other; only vectors and the compiler are common."""
    engine = {f"fiveaxis.collision.{name}" for name in ("pieces", "convex_pair", "tree_pair")}
    assert engine <= reached("fiveaxis.verification.collisions")
    for module in ("pieces", "convex_pair", "tree_pair"):
        used = {name.split(".")[1] for name in reached(f"fiveaxis.collision.{module}") - engine}
        assert used <= {"compiled", "geometry"}
    for module in ("collision.obstacles", "collision.accessibility", "posture.mask", "posture.optimiser"):
        assert not engine & reached(f"fiveaxis.{module}")
