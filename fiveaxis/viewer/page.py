"""The scene as one HTML page that needs no network and no server."""

from __future__ import annotations

import base64
import html
import json
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis.files import write_atomically
from fiveaxis.viewer.colours import VIRIDIS
from fiveaxis.viewer.library import load_meshcat
from fiveaxis.viewer.scene import ROOT, Legend, build_scene

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.posture.solution import Solution

# The page may run what it carries and fetch nothing: a browser holds it to that.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src data: blob:; font-src data:"
)

STYLE = """
body { margin: 0; background: #17191e; }
#meshcat-pane { width: 100vw; height: 100vh; overflow: hidden; }
#legend { position: fixed; left: 16px; top: 16px; max-width: 22em; padding: 12px 16px; border-radius: 8px;
  background: rgba(20, 22, 27, .82); color: #e8eaed; font: 14px/1.5 system-ui, sans-serif; }
#legend h1 { font-size: 16px; margin: 0 0 4px; }
#legend p { margin: 4px 0; }
#legend label { display: inline-block; margin-right: 12px; }
#scale { height: 10px; border-radius: 3px; margin-top: 8px; }
#ends { display: flex; justify-content: space-between; font-size: 12px; }
"""

SCRIPT = """
const viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
const bytes = text => Uint8Array.from(atob(text), character => character.charCodeAt(0));
for (const command of commands) viewer.handle_command_bytearray(bytes(command));
for (const box of document.querySelectorAll("#legend input"))
  box.addEventListener("change", () => viewer.handle_command(
    {type: "set_property", path: box.value, property: "visible", value: box.checked}));
"""


class Recorder:
    """Stands in for meshcat's window: keeps the commands, so that no server process is needed."""

    def __init__(self) -> None:
        self.commands: list[bytes] = []

    def send(self, command: Any) -> None:
        """Keep a command as the bytes that a browser would get."""
        self.commands.append(import_module("umsgpack").packb(command.lower()))


def write_preview(
    solution: Solution, path: str | Path, *, part: str | Path | trimesh.Trimesh | None = None
) -> Path:
    """Write the scene as one HTML page that works offline.

    The same solution gives the same bytes.

    Parameters
    ----------
    solution : what to show
    path : of the page
    part : mesh of the part in mm, or its file

    Raises
    ------
    MeshError
        The part or a mesh of the machine can't be read.
    SettingError
        The page can't be written there.
    """
    return write_atomically(path, render_page(solution, part=part))


def render_page(solution: Solution, *, part: str | Path | trimesh.Trimesh | None = None) -> str:
    """Make the page's text; see `write_preview`."""
    meshcat = load_meshcat()
    recorder = Recorder()
    legend = build_scene(meshcat.Visualizer(window=recorder), solution, part)
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    licence = bundle.with_name("main.min.js.LICENSE.txt")
    commands = json.dumps([base64.b64encode(c).decode("ascii") for c in recorder.commands], indent=0)
    title = html.escape(Path(solution.toolpath.name).name)
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
            f"<title>{title}: fiveaxis preview</title>",
            f"<style>{STYLE}</style>\n</head>\n<body>",
            '<div id="meshcat-pane"></div>',
            _legend(solution, legend, title),
            f'<script type="text/plain" id="licences">\n{licence.read_text(encoding="utf-8")}\n</script>',
            f"<script>\n{bundle.read_text(encoding='utf-8')}\n</script>",
            f"<script>\nconst commands = {commands};\n{SCRIPT}</script>",
            "</body>\n</html>\n",
        ]
    )


def _legend(solution: Solution, legend: Legend, title: str) -> str:
    """Say in a corner of the page what there is to see."""
    lines = [f"<h1>{title}</h1>", f"<p>{len(solution.toolpath)} locations</p>", _energies(solution, legend)]
    boxes = [_box("result", "after", True)]
    if legend.before is not None:
        boxes.append(_box(legend.before, "before", False))
    if legend.has_part:
        boxes.append(_box("part", "part", True))
    if legend.has_machine:
        boxes.append(_box("machine", "machine", False))
    lines.append(f"<p>{''.join(boxes)}</p>")
    if legend.pace > 1.0:
        lines.append(f"<p>tool shown {legend.pace:.1f} times as fast as programmed</p>")
    stops = ", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255.0 * stop)) for stop in VIRIDIS)
    lines.append(f'<div id="scale" style="background: linear-gradient(to right, {stops})"></div>')
    lines.append(f'<div id="ends"><span>0</span><span>{legend.top:.3g} J/mm and more</span></div>')
    return '<div id="legend">' + "\n".join(lines) + "</div>"


def _energies(solution: Solution, legend: Legend) -> str:
    figures = [f"result {solution.energy.total:,.0f} J"]
    if legend.before is not None:
        before = solution.compared[legend.before].energy.total
        figures.append(f"{html.escape(legend.before)} {before:,.0f} J")
    return f"<p>{', '.join(figures)}<br>travel metric of the feed drives</p>"


def _box(label: str, node: str, checked: bool) -> str:
    state = " checked" if checked else ""
    return (
        f'<label><input type="checkbox" value="/meshcat/{ROOT}/{node}"{state}> {html.escape(label)}</label>'
    )
