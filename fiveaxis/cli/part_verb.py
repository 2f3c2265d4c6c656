"""The faces of a CAD file, as `fiveaxis info` shows them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

from fiveaxis.cli.terminal import err, out, print_json
from fiveaxis.cli.work import shown_work
from fiveaxis.options import Unit

if TYPE_CHECKING:
    from fiveaxis.mesh.cad.choice import FaceSheet


def print_faces(path: Path, tool: str | None, unit: Unit | None, body: str | None, *, as_json: bool) -> None:
    """Print the faces of a CAD file, and whether a ball is small enough for their hollows."""
    from fiveaxis.mesh import load_mesh, mesh_size, model_of, size_text
    from fiveaxis.mesh.cad.choice import survey
    from fiveaxis.toolpath import parse_tool

    radius = None if tool is None else parse_tool(tool).radius
    with shown_work(err, hidden=as_json):
        mesh = load_mesh(path, unit=unit, body=body, allow_open=True)
        model = model_of(mesh)
        sheets = () if model is None else survey(model)
    size, bodies = mesh_size(mesh), {} if model is None else model.bodies
    if as_json:
        return print_json(
            {
                "part": str(path),
                "size_mm": [round(float(extent), 6) for extent in size],
                "closed": bool(mesh.is_watertight),
                "mesh_deviation_mm": None if model is None else round(model.deviation, 6),
                "bodies": [{"number": number, "name": name} for number, name in bodies.items()],
                "faces": [
                    sheet.as_dict() | ({} if radius is None else {"ball_fits": sheet.takes(radius)})
                    for sheet in sheets
                ],
            }
        )
    out.print(f"part {size_text(size)}, {'closed' if mesh.is_watertight else 'open'}", highlight=False)
    for number, name in bodies.items():
        out.print(f"body {number}: {name}", markup=False, highlight=False)
    out.print(_table(sheets, radius))


def _table(sheets: tuple[FaceSheet, ...], radius: float | None) -> Table:
    heads = ["face", "body", "kind", "area mm²", "normal", "spread °", "overhang %", "hollow mm"]
    heads += ["ball"] * (radius is not None) + ["colour", "layer"]
    table = Table(*heads, box=None)
    for sheet in sheets:
        face = sheet.face
        row = [str(face.number), str(face.body), face.kind, f"{face.area:.2f}"]
        row += [" ".join(f"{round(value, 2) + 0.0:.2f}" for value in sheet.normal), f"{sheet.spread:.1f}"]
        row += [f"{100.0 * sheet.overhang:.0f}"]
        row += [f"{sheet.hollow:.2f}" if math.isfinite(sheet.hollow) else ""]
        if radius is not None:
            row += ["fits" if sheet.takes(radius) else "too large"]
        table.add_row(*row, face.colour, escape(face.layer))
    return table
