"""What a verdict is about: a motion on a machine, as a short text that tells it from every other."""

from __future__ import annotations

import hashlib

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion


def motion_digest(motion: Motion, machine: Machine) -> str:
    """Digest the places of a motion, which of its moves cut, and the chain that leads the tool there.

    Durations don't count: the same motion slower is the same way. The tool's length is in the chain.

    Returns
    -------
    sha256, hexadecimal
    """
    digest = hashlib.sha256(f"{motion.letters} {machine.code.text} {len(motion)}".encode())
    lines = [(*joint.line.direction, *joint.line.point) for joint in machine.chain.joints]
    for figures in (motion.positions, np.array(lines), machine.chain.tool_home):
        digest.update(_bytes(figures))
    digest.update(np.ascontiguousarray(motion.kind, dtype="<i8").tobytes())
    return digest.hexdigest()


def _bytes(figures: Array) -> bytes:
    # Adding nothing makes one zero of two.
    return np.ascontiguousarray(np.asarray(figures, dtype="<f8") + 0.0).tobytes()
