"""The tables of houses and rooms in ARCHITECTURE.md are true: doors, layers, libraries, no circle."""

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
ARCHITECTURE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
# What every room may import, as ARCHITECTURE.md says; `lazy_loader` opens doors.
ANYWHERE = {"fiveaxis", "lazy_loader", "numpy", "scipy", "pydantic", "pydantic_core"}
ANYWHERE |= sys.stdlib_module_names
# The calls to a higher room, by file, as ARCHITECTURE.md says: imported in the function, when it is called.
UPWARDS = re.compile(r"^One call goes up: `([\w/.]+)` calls `(\w+)`", re.MULTILINE)
((UPWARD_FILE, UPWARD_ROOM),) = UPWARDS.findall(ARCHITECTURE)
HOUSE = re.compile(r"^\| `(\w+)` \| (nothing|all above|`[`\w, ]+`) \| [^|]+ \|$", re.MULTILINE)
ROW = re.compile(r"^\| `(\w+)` \| `(\w+)` \| (\d+) \| [^|]+ \|([^|]*)\|$", re.MULTILINE)
LIBRARY = re.compile(r"(\w+)(?: \(([^)]*)\))?")


def read_houses() -> dict[str, set[str]]:
    """Read house → houses that it may import."""
    houses: dict[str, set[str]] = {}
    for name, cell in HOUSE.findall(ARCHITECTURE):
        houses[name] = set(houses) if cell == "all above" else set(re.findall(r"`(\w+)`", cell))
    return houses


HOUSES = read_houses()


class Room(NamedTuple):
    """A row of the table: house, layer, and libraries with the files that may import them, all if none."""

    house: str
    layer: int
    libraries: dict[str, set[str]]


def read_rooms() -> dict[str, Room]:
    rooms = {}
    for house, name, layer, cell in ROW.findall(ARCHITECTURE):
        libraries = {lib: set(re.findall(r"`([^`]+)`", files)) for lib, files in LIBRARY.findall(cell)}
        rooms[name] = Room(house, int(layer), libraries)
    return rooms


ROOMS = read_rooms()


def read_door(house: str) -> dict[str, str]:
    """Read the stub of a house: public name → the module that has it."""
    stub = PACKAGE / house / "__init__.pyi"
    tree = ast.parse(stub.read_text(encoding="utf-8")) if stub.is_file() else ast.Module([], [])
    return {
        alias.name: f"fiveaxis.{house}.{node.module}"
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


DOORS = {house: read_door(house) for house in HOUSES}


def house_of(module: str) -> str:
    return [*module.split("."), ""][1]


def room_of(module: str) -> str:
    """Name the room of a module: the folder or module in its house, or the house where that is one room."""
    _, house, inner, *_ = [*module.split("."), "", ""]
    return inner if inner in ROOMS and ROOMS[inner].house == house else house


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


# Doors are read from their stubs; the command line has none.
MODULES = {
    name_of(path): path for path in sorted(PACKAGE.rglob("*.py")) if not path.with_suffix(".pyi").is_file()
}


def nodes(node: ast.AST, *, types: bool) -> Iterator[ast.AST]:
    """Every node that runs, with or without what only a type checker reads."""
    if not types and isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield node
    for child in ast.iter_child_nodes(node):
        yield from nodes(child, types=types)


@cache
def written(path: Path, *, types: bool = False) -> tuple[tuple[str, str], ...]:
    """List the imports of a module as they are written, within functions too: module, name (or nothing)."""
    return tuple(find_written(path, types=types))


def find_written(path: Path, *, types: bool) -> Iterator[tuple[str, str]]:
    for node in nodes(ast.parse(path.read_text(encoding="utf-8")), types=types):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: relative import"
            yield from ((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "import_module":
            yield from ((str(a.value), "") for a in node.args if isinstance(a, ast.Constant))


def imports(path: Path, *, types: bool = False) -> Iterator[str]:
    """Name the modules that a module imports, through doors to the module behind."""
    for module, name in written(path, types=types):
        house = module.removeprefix("fiveaxis.")
        if house in DOORS and name in DOORS[house]:
            yield DOORS[house][name]
        else:
            yield module
            if name:
                yield f"{module}.{name}"


def test_the_tables_have_every_house_and_room_and_no_other():
    assert set(HOUSES) == {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert len(HOUSES) <= 10
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py"}
    assert {(ROOMS[room_of(module)].house, room_of(module)) for module in MODULES} == {
        (room.house, name) for name, room in ROOMS.items()
    }


def test_a_house_is_entered_by_its_door_only_and_by_those_that_may():
    wrong = []
    for module, path in MODULES.items():
        for other, name in written(path, types=True):
            house = house_of(other)
            if other.startswith("fiveaxis.") and house != house_of(module):
                if other != f"fiveaxis.{house}" or (DOORS[house] and name not in DOORS[house]):
                    wrong.append(f"{module} passes the door of {house}: {other} {name}")
                if house not in HOUSES[house_of(module)]:
                    wrong.append(f"{module} imports {house}, which isn't in its row")
    assert wrong == []


def test_doors_have_what_others_take_and_no_more():
    taken = {house: set() for house in HOUSES}
    for module, path in MODULES.items():
        for other, name in written(path, types=True):
            if other.startswith("fiveaxis.") and house_of(other) != house_of(module):
                taken[house_of(other)].add(name)
    for path in [*ROOT.glob("docs/pages/**/*.md"), *ROOT.glob("examples/**/*.py")]:
        for house, names in re.findall(
            r"from fiveaxis\.(\w+) import ([\w, ]+)", path.read_text(encoding="utf-8")
        ):
            taken[house] |= set(re.findall(r"\w+", names))
    for node in ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            taken[str(node.module)] |= {alias.name for alias in node.names}
    unused = {house: set(door) - taken[house] for house, door in DOORS.items()}
    assert not any(unused.values()), unused


def test_no_house_imports_another_in_a_circle():
    list(TopologicalSorter(HOUSES).static_order())


def test_a_room_imports_lower_rooms_only():
    wrong = []
    for module, path in MODULES.items():
        here = room_of(module)
        for name in imports(path, types=True):
            other = room_of(name)
            if (path.relative_to(PACKAGE).as_posix(), other) == (UPWARD_FILE, UPWARD_ROOM):
                continue
            if name.startswith("fiveaxis.") and other in ROOMS and other != here:
                wrong += [f"{module} imports {name}"] * (ROOMS[other].layer >= ROOMS[here].layer)
    assert wrong == []


def test_what_is_called_upwards_is_imported_when_it_is_called():
    tree = ast.parse((PACKAGE / UPWARD_FILE).read_text(encoding="utf-8"))
    at_once = [ast.unparse(node) for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert UPWARD_ROOM in {room_of(name) for name in imports(PACKAGE / UPWARD_FILE)}
    assert not any(UPWARD_ROOM in text for text in at_once)


def test_a_room_imports_its_own_libraries_only_and_needs_each():
    """The table gives a library to a room, or to some of its files; all that import it, and no others."""
    found = set()
    for module, path in MODULES.items():
        room = room_of(module)
        parts = path.relative_to(PACKAGE / ROOMS[room].house).parts
        here = "/".join(parts[1:] if parts[0] == room else parts)
        for library in {name.split(".")[0] for name in imports(path)} - ANYWHERE:
            found.add((room, library, here if ROOMS[room].libraries.get(library) else ""))
    table = ((room, library, files) for room in ROOMS for library, files in ROOMS[room].libraries.items())
    assert found == {(room, library, file) for room, library, files in table for file in files or {""}}


def test_no_modules_import_each_other_in_a_circle():
    graph = {
        module: {name for name in imports(path) if name in MODULES and name != module}
        for module, path in MODULES.items()
        if path.relative_to(PACKAGE).as_posix() != UPWARD_FILE
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))


def reached(module: str) -> set[str]:
    """A module of the package, and all that it imports, at once or later."""
    found, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        if name not in found and name in MODULES:
            found.add(name)
            waiting += [other for other in imports(MODULES[name]) if other.startswith("fiveaxis.")]
    return found


def test_the_check_of_collisions_shares_no_tree_and_no_loop_with_the_mask_of_the_search():
    """Else a fault of one could hide in the other; only vectors and the compiler are common."""
    engine = {f"fiveaxis.check.collision.{name}" for name in ("pieces", "convex_pair", "tree_pair")}
    assert engine <= reached("fiveaxis.check.verification.collisions")
    for name in engine:
        used = {room_of(name) for name in reached(name) - engine}
        assert used <= {"compiling", "geometry"}
    for module in ("check.collision.obstacles", "check.collision.accessibility", "posture.optimiser"):
        assert f"fiveaxis.{module}" in MODULES
        assert not engine & reached(f"fiveaxis.{module}")


def test_verification_uses_no_equation_of_what_it_checks():
    for module, path in MODULES.items():
        if room_of(module) == "verification":
            used = {room_of(name) for name in imports(path, types=True) if name.startswith("fiveaxis.")}
            assert not used & {"kinematics", "posture"}, module
