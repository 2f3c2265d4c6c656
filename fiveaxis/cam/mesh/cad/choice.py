"""Faces of a model that users name by number, colour or layer, and what is told of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    Finding,
    IntArray,
    Place,
    SettingError,
    Severity,
    angle_between,
    product,
)
from fiveaxis.cam.mesh.cad.model import Model
from fiveaxis.cam.mesh.cad.records import Face

# A wall overhangs where its normal points at least this far below the horizontal.
LEAST_OVERHANG = np.radians(1.0)
# 1/mm: hollows that are flatter are planes with rounding errors.
FLAT = 1e-6
# Share of the chosen area that a plan may leave out without being an error.
MOST = 0.5


def of_faces(model: Model | None, text: str, name: str) -> BoolArray:
    """Check which triangles of a model, (t,), are of the faces that users mean (`find_faces`).

    `SettingError` if there is no model: a mesh has no faces; or as `find_faces`.
    """
    if model is None:
        raise SettingError(
            f"faces = {text!r}: a mesh has no faces to choose from; give the STEP file it was made of",
            file=name,
        )
    return np.isin(model.owner, find_faces(model, text, name))


def find_faces(model: Model, text: str, name: str) -> tuple[int, ...]:
    """Find faces, from 0, by what users call them: numbers ``12,13``, colours ``#rrggbb``, layers.

    `SettingError` for one that no face has.
    """
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if not any(_is_called(face, word) for face in model.faces):
            raise SettingError(f"faces = {text!r}: no face is called {word!r}; {_names(model)}", file=name)
    return tuple(i for i, face in enumerate(model.faces) if any(_is_called(face, word) for word in words))


def uncut_findings(model: Model, text: str, contacts: Array, name: str) -> tuple[Finding, ...]:
    """Return the finding that chosen faces have no contact: an error if they are most of what was chosen.

    `text` is as of `find_faces`, `contacts` are (n, 3) mm of the passes.
    """
    chosen = [model.faces[i] for i in find_faces(model, text, name)]
    touched = {model.faces[i].number for i in np.unique(model.nearest(contacts).face)}
    uncut = [face for face in chosen if face.number not in touched]
    if not uncut:
        return ()
    share = sum(face.area for face in uncut) / sum(face.area for face in chosen)
    numbers = ", ".join(str(face.number) for face in uncut)
    message = (
        f"no pass touches face{'s' * (len(uncut) > 1)} {numbers}, {100.0 * share:.0f} % of the chosen area: "
        "flat against the sections, out of reach, or too small for them; take another strategy, a finer "
        "step, or a smaller ball"
    )
    severity = Severity.ERROR if share > MOST else Severity.WARNING
    return (Finding(severity, "faces-left-out", message, Place(file=name), float(len(uncut))),)


def _is_called(face: Face, word: str) -> bool:
    if word.isdecimal() or not word:
        return word == str(face.number)
    return word.lower() == face.colour or word == face.layer


def _names(model: Model) -> str:
    """List what faces are called."""
    known = [f"numbers {model.faces[0].number} to {model.faces[-1].number}"]
    for what, names in (
        ("colours", {face.colour for face in model.faces}),
        ("layers", {face.layer for face in model.faces}),
    ):
        if names - {""}:
            known.append(f"{what} {', '.join(sorted(names - {''}))}")
    return f"there are {'; '.join(known)} (fiveaxis info lists them)"


@dataclass(frozen=True)
class FaceSheet:
    """A face with the figures by which it is chosen.

    Parameters
    ----------
    face : as in the model
    normal : mean of its normals by area; short or zero where it bends around
    spread : deg, the largest angle of a normal from the mean one; 180 where there is none
    overhang : share of its area that points below the horizontal, 0…1
    hollow : mm, the smallest radius of a hollow, infinite where it has none: a larger ball doesn't fit
    """

    face: Face
    normal: tuple[float, float, float]
    spread: float
    overhang: float
    hollow: float

    def takes(self, radius: float) -> bool:
        """Check whether a ball, radius in mm, is small enough for the face's hollows.

        What stands beside the face isn't looked at.
        """
        return radius <= self.hollow * (1.0 + 1e-9)

    def as_dict(self) -> dict[str, Any]:
        """Return its figures as JSON has them."""
        face = self.face
        return {
            "number": face.number,
            "body": face.body,
            "kind": face.kind,
            "area_mm2": round(face.area, 6),
            "normal": [round(value, 6) for value in self.normal],
            "normal_spread_deg": round(self.spread, 3),
            "overhang_share": round(self.overhang, 4),
            "hollow_radius_mm": round(self.hollow, 6) if math.isfinite(self.hollow) else None,
            "colour": face.colour or None,
            "layer": face.layer or None,
        }


def survey(model: Model) -> tuple[FaceSheet, ...]:
    """Describe every face of a model, measured at the corners and middles of its triangles."""
    uv = np.concatenate([model.corners_uv, model.corners_uv.mean(axis=1, keepdims=True)], axis=1)
    owner = np.repeat(model.owner, 4)
    normals = model.normals(owner, uv.reshape(-1, 2)).reshape(-1, 4, 3)
    bends = model.curvatures(owner, uv.reshape(-1, 2))[:, 1].reshape(-1, 4)
    edges = model.corners[:, 1:] - model.corners[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2.0
    order = np.argsort(model.owner, kind="stable")
    ends = np.searchsorted(model.owner[order], np.arange(len(model.faces) + 1))
    return tuple(
        _sheet(face, rows, normals, bends, areas)
        for face, a, b in zip(model.faces, ends[:-1], ends[1:], strict=True)
        for rows in (order[a:b],)
    )


def _sheet(face: Face, rows: IntArray, normals: Array, bends: Array, areas: Array) -> FaceSheet:
    weights = areas[rows] / max(float(areas[rows].sum()), 1e-300)
    mean = product(weights, normals[rows, 3])
    known = float(np.linalg.norm(mean, axis=-1)) > 1e-3
    spread = angle_between(normals[rows].reshape(-1, 3), mean[None]).max() if known else math.pi
    below = normals[rows, 3, 2] <= -np.sin(LEAST_OVERHANG)
    bend = float(bends[rows].max(initial=0.0))
    return FaceSheet(
        face=face,
        normal=tuple(mean.tolist()),
        spread=math.degrees(float(spread)),
        overhang=float(weights[below].sum()),
        hollow=1.0 / bend if bend > FLAT else math.inf,
    )
