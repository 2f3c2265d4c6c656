"""Reading XML files of other programs."""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.etree import ElementTree

from fiveaxis.errors import MachineError
from fiveaxis.files import MEGABYTE, read_input

# Simulation files have pictures and meshes in them.
MOST_BYTES = 20 * MEGABYTE
# km-long machines and numbers that overflow when they are squared are faults of the file.
LARGEST = 1e6


def read_xml(path: Path, root: str) -> ElementTree.Element:
    """Read an XML file.

    Parameters
    ----------
    path : the file
    root : tag of its root element

    Raises
    ------
    MachineError
        The file can't be read, isn't XML, declares entities, or has another root element.
    """
    content = read_input(path, MOST_BYTES, MachineError)
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise MachineError(
            "declares a document type or entities, which no machine needs; remove them", file=path
        )
    try:
        element = ElementTree.fromstring(content)
    except (ElementTree.ParseError, LookupError, ValueError) as fault:
        found = re.search(r"line (\d+)", str(fault))
        raise MachineError(
            f"isn't XML: {fault}", file=path, line=None if found is None else int(found[1])
        ) from None
    if element.tag != root:
        raise MachineError(f"has the root element <{element.tag}>; <{root}> is expected", file=path)
    return element


def as_number(text: str) -> float | None:
    """Read a number; None if it isn't one that a machine has."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and abs(number) <= LARGEST else None
