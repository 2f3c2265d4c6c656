"""meshcat, imported when needed, with reproducible identifiers."""

from __future__ import annotations

import uuid
import warnings
from importlib import import_module
from typing import Any

import numpy as np

# Identifiers of scene objects follow from this and their name, so a scene always has the same bytes.
NAMESPACE = uuid.UUID("5d0a4f0e-6c1b-5e55-9a0f-640123000000")
# Turns meshcat's cylinder, which lies along y about its middle, along z.
UPRIGHT = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)


def load_meshcat() -> Any:
    """Import meshcat without the deprecation warning of its import of zmq."""
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", message="zmq.eventloop.ioloop is deprecated", category=DeprecationWarning
        )
        return import_module("meshcat")


def identify(thing: Any, name: str) -> Any:
    """Set the identifiers of a meshcat object, its geometry and its material, from a name.

    meshcat's own come from the clock and the network card.
    """
    thing.uuid = str(uuid.uuid5(NAMESPACE, name))
    thing.geometry.uuid = str(uuid.uuid5(NAMESPACE, f"{name}/geometry"))
    thing.material.uuid = str(uuid.uuid5(NAMESPACE, f"{name}/material"))
    return thing
