"""The small path that tests of postures share."""

import numpy as np

from fiveaxis.model import Tool, Toolpath


def ring(n: int = 80, n_z: float = -0.3, radius: float = 20.0) -> Toolpath:
    """Contacts once round a lobed wall, normals leaning downwards where `n_z` is negative."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    flat = np.sqrt(1.0 - n_z**2)
    normal = np.stack([flat * np.cos(angle), flat * np.sin(angle), np.full(n, n_z)], axis=1)
    r = radius + 3.0 * np.cos(3.0 * angle)
    contact = np.stack([r * np.cos(angle), r * np.sin(angle), np.full(n, 10.0)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6), name="ring")
