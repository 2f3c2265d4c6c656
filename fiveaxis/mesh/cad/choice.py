"""Faces of a model that users name by number, colour or layer."""

from __future__ import annotations

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.mesh.cad.model import Model
from fiveaxis.mesh.cad.records import Face

# Share of the chosen area that a plan may leave out without being an error.
MOST = 0.5


def of_faces(model: Model | None, text: str, name: str) -> BoolArray:
    """Check which triangles of a model, (t,), are of the faces that users mean (`find_faces`).

    Raises
    ------
    SettingError
        There is no model: a mesh has no faces; or as `find_faces`.
    """
    if model is None:
        raise SettingError(
            f"faces = {text!r}: a mesh has no faces to choose from; give the STEP file it was made of",
            file=name,
        )
    return np.isin(model.owner, find_faces(model, text, name))


def find_faces(model: Model, text: str, name: str) -> tuple[int, ...]:
    """Find faces by what users call them.

    Parameters
    ----------
    text : ``12,13``: numbers, colours ``#rrggbb`` and names of layers
    name : of the part's file

    Returns
    -------
    From 0, in the order of the model

    Raises
    ------
    SettingError
        A number, colour or layer that no face has.
    """
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if not any(_is_called(face, word) for face in model.faces):
            raise SettingError(f"faces = {text!r}: no face is called {word!r}; {_names(model)}", file=name)
    return tuple(i for i, face in enumerate(model.faces) if any(_is_called(face, word) for word in words))


def uncut_findings(model: Model, text: str, contacts: Array, name: str) -> tuple[Finding, ...]:
    """Return the finding that chosen faces have no contact: an error if they are most of what was chosen.

    Parameters
    ----------
    text : as of `find_faces`
    contacts : (n, 3), mm, of the passes
    name : of the part's file
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
