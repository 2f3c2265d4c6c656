"""CAD files: reading them in a process with limits, and one error for whatever is wrong with them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import (
    CAD_SUFFIXES,
    MEGABYTE,
    MESH_TOLERANCE,
    MOST_MESH_BYTES,
    MeshError,
    MissingDependency,
    Unit,
    kept_by_file,
    read_input,
)
from fiveaxis.cam.mesh.cad.model import Model
from fiveaxis.cam.mesh.cad.records import KINDS, Face

READER = Path(__file__).with_name("reader.py")
# Bytes of address space: 4 GiB are enough for parts of 100 000 faces.
MEMORY = 4 << 30
# s, for reading any file, and more per MB: 0.3 s per MB of ordinary parts, 5 s of twisted blades.
SECONDS, SECONDS_PER_MEGABYTE = 30.0, 15.0
MOST_FACES = 100_000
# Names of units of length in STEP and IGES files.
UNIT_NAMES: Mapping[str, Unit] = {
    "millimetre": "mm",
    "millimeter": "mm",
    "mm": "mm",
    "inch": "inch",
    "in": "inch",
    "metre": "m",
    "meter": "m",
    "m": "m",
}
FACTORS: Mapping[Unit, float] = {"mm": 1.0, "inch": 25.4, "m": 1000.0}
STEP_FACE = re.compile(rb"=\s*(?:ADVANCED_FACE|FACE_SURFACE)\s*\(")
# Lines of an IGES directory, two per entity: trimmed surfaces and faces.
IGES_FACE = re.compile(rb"^ {5}(?:143|144|510).{64}D", re.MULTILINE)


# A job asks for its part several times: to plan, to check, to show.
@kept_by_file(4)
def load_model(
    file: Path,
    *,
    unit: Unit | None = None,
    mesh_tolerance: float = MESH_TOLERANCE,
    body: str | None = None,
    seconds: float | None = None,
) -> Model:
    """Read a STEP or IGES file as exact surfaces with their mesh, in mm.

    Parameters
    ----------
    unit : of a file that doesn't state its own
    mesh_tolerance : mm, chords of the mesh
    body : name or number of the one that is taken; by default all
    seconds : after which reading is ended; by default by the size of the file

    Raises
    ------
    MissingDependency
        Open Cascade isn't installed.
    MeshError
        The file can't be read as a whole, within the time and memory; it states no unit, or another one;
        there is no such body.
    """
    content = read_input(file, MOST_MESH_BYTES, MeshError)
    if find_spec("OCP") is None:
        raise MissingDependency(
            "Open Cascade",
            f"reading {file}",
            "install it with `pip install 'fiveaxis[step]'`, or export a mesh (.stl)",
        )
    step = file.suffix.lower() in CAD_SUFFIXES[:2]
    faces = len(STEP_FACE.findall(content)) if step else len(IGES_FACE.findall(content)) // 2
    if faces > MOST_FACES:
        raise MeshError(
            f"has {faces:,} faces, more than the {MOST_FACES:,} that are read; export the part alone, or a "
            "mesh (.stl)",
            file=file,
        )
    limit = seconds or SECONDS + SECONDS_PER_MEGABYTE * len(content) / MEGABYTE
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "model.npz"
        request = {
            "file": str(file.resolve()),
            "output": str(output),
            "tolerance": mesh_tolerance,
            "factor": FACTORS[unit] if unit else 0.0,
            "body": body or "",
            "memory": MEMORY,
            "seconds": int(limit) + 1,
        }
        _run(file, request, limit)
        with np.load(output) as arrays:
            facts = json.loads(str(arrays["facts"]))
            _require_whole(facts, file, faces, unit, body)
            found = tuple(
                Face(kind=KINDS[kind], **{**face, "box": tuple(face["box"])})
                for face, kind in zip(facts["faces"], arrays["kind"], strict=True)
            )
            return Model.of(str(file), arrays, found, tuple(map(tuple, facts["meeting"])))


def _run(file: Path, request: Mapping[str, Any], seconds: float) -> None:
    """Run the reader to its end, or end it after so many seconds."""
    # -P: modules beside the reader don't hide those of the standard library.
    call = [sys.executable, "-P", str(READER), json.dumps(request)]
    try:
        done = subprocess.run(
            call, stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired:
        raise MeshError(
            f"isn't read within {seconds:g} s: it is damaged; export it again", file=file
        ) from None
    last = (done.stderr.decode("utf-8", "replace").strip().splitlines() or [""])[-1]
    if done.returncode == 2:
        raise MeshError(last, file=file)
    if done.returncode == 3 or "bad_alloc" in last or "MemoryError" in last:
        raise MeshError(
            f"takes more than {MEMORY >> 30} GB of memory to read: it is damaged, or too large; export the "
            "part alone, or take a larger mesh_tolerance",
            file=file,
        )
    if done.returncode:
        raise MeshError(
            f"Open Cascade failed on it ({last or done.returncode}): it is damaged; export it again",
            file=file,
        )


def _require_whole(
    facts: Mapping[str, Any], name: Path, faces: int, unit: Unit | None, body: str | None
) -> None:
    """Raise unless the reader found the unit, the body, and all faces of the file."""
    units = facts["units"]
    if not units and unit is None:
        raise MeshError("states no unit; say which it is (--unit mm, --unit inch)", file=name)
    if units and unit and {UNIT_NAMES.get(stated) for stated in units} != {unit}:
        stated = " and ".join(dict.fromkeys(units))
        raise MeshError(f"is in {stated}, as it states itself, and unit = {unit}; leave unit out", file=name)
    if facts["built"] < faces:
        raise MeshError(
            f"only {facts['built']} of its {faces} faces could be built: it is damaged; export it again",
            file=name,
        )
    bodies = facts["bodies"]
    listed = ", ".join(f"{i} {text!r}" for i, text in enumerate(bodies[:20], start=1))
    if not bodies:
        raise MeshError("holds no faces, only points or curves; export solids or surfaces", file=name)
    if body and not facts["chosen"]:
        raise MeshError(f"has no body {body!r}; there are {listed}", file=name)
    if len(facts["chosen"]) > 1:
        numbers = " and ".join(map(str, facts["chosen"]))
        raise MeshError(f"{body!r} is the name of bodies {numbers}; give the number of one", file=name)
