"""The stock that a page of the simulation holds, decoded as its script does."""

import base64
import gzip
import json
import re

import numpy as np
import trimesh


def unpacked(page: str) -> tuple[dict, dict[str, np.ndarray]]:
    """Return head and arrays of a page, as its script decodes them."""
    packed = re.search(r'id="scene">\n(\S+)\n', page)
    content = gzip.decompress(base64.b64decode(packed[1]))
    size = int.from_bytes(content[:4], "little")
    head = json.loads(content[4 : 4 + size])
    start, arrays = 4 + size + sum(head["commands"]), {}
    for name, meaning in head["sections"].items():
        values = np.frombuffer(content[start : start + meaning["size"]], f"<{meaning['kind']}")
        arrays[name], start = values * meaning.get("unit", 1), start + meaning["size"]
    return head, arrays


def surface(head: dict, arrays: dict[str, np.ndarray], step: int) -> trimesh.Trimesh:
    """Return what the page draws of the stock after a step."""
    there = (arrays["stock/born"] <= step) & (step < arrays["stock/gone"])
    assert there.sum() <= head["stock"]["most"]
    quads = arrays["stock/quads"].reshape(-1, 4)[there]
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    vertices = arrays["stock/vertices"].reshape(-1, 3) + head["stock"]["low"]
    return trimesh.Trimesh(vertices, faces, process=False)
