"""meshcat, loaded when it is needed and made to repeat itself exactly."""

from __future__ import annotations

import uuid
import warnings
from importlib import import_module
from typing import Any

import numpy as np

# Identifiers of scene objects follow from this and their name: a scene has the same bytes each time.
NAMESPACE = uuid.UUID("5d0a4f0e-6c1b-5e55-9a0f-640123000000")
# meshcat's cylinder stands along y about its middle; this turns it along z.
UPRIGHT = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)


def load_meshcat() -> Any:
    """Import meshcat without the deprecation warning of its own import of zmq."""
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", message="zmq.eventloop.ioloop is deprecated", category=DeprecationWarning
        )
        return import_module("meshcat")


def identify(thing: Any, name: str) -> Any:
    """Give a meshcat object, its geometry and its material identifiers that follow from a name.

    meshcat takes them from the clock and the network card.
    """
    thing.uuid = str(uuid.uuid5(NAMESPACE, name))
    thing.geometry.uuid = str(uuid.uuid5(NAMESPACE, f"{name}/geometry"))
    thing.material.uuid = str(uuid.uuid5(NAMESPACE, f"{name}/material"))
    return thing
