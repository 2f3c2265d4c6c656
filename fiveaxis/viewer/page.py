"""The scene as one HTML page that needs no network and no server, with meshcat's commands packed in it."""

from __future__ import annotations

import base64
import gzip
import json
import logging
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis.files import write_atomically
from fiveaxis.viewer.legend import make_controls, make_legend, title_of
from fiveaxis.viewer.library import load_meshcat
from fiveaxis.viewer.scene import ROOT, Layout, Scene, build_scene

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.collision import Surroundings
    from fiveaxis.findings import Finding
    from fiveaxis.posture.solution import Solution

logger = logging.getLogger(__name__)

# The browser lets the page run only its own scripts and fetch nothing.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'"
)
# Digits of the show's figures.
DIGITS = 6


def write_preview(
    solution: Solution,
    path: str | Path,
    *,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> Path:
    """Write the scene as one HTML page that works offline; the same solution gives the same bytes.

    Parameters
    ----------
    solution : to show
    path : of the page
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures to show
    findings : of verification, on the solution's motion

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    SettingError
        The page can't be written there.
    """
    page = render_page(solution, part=part, surroundings=surroundings, findings=findings)
    logger.info("%s: %d kB", Path(path).name, len(page) // 1000)
    return write_atomically(path, page)


def render_page(
    solution: Solution,
    *,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> str:
    """Return the text of the page that `write_preview` writes."""
    meshcat = load_meshcat()
    recorder = Recorder()
    vis = meshcat.Visualizer(window=recorder)
    scene = build_scene(vis, solution, part, surroundings=surroundings, findings=findings)
    for side in scene.sides:
        logger.debug(
            "%s: %d of %d locations are key frames", side.name, len(side.frames.rows), len(side.motion)
        )
    logger.debug("%d messages to the scene; %d findings", len(recorder.commands), len(findings))
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    licence = bundle.with_name("main.min.js.LICENSE.txt")
    here = Path(__file__)
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
            f"<title>{title_of(solution)}: fiveaxis preview</title>",
            f"<style>\n{_text(here.with_name('preview.css'))}</style>\n</head>\n<body>",
            '<div id="meshcat-pane"></div>',
            make_legend(solution, scene, findings),
            make_controls(scene.sides[0].frames.pace),
            '<div id="fault" role="alert" hidden></div>',
            f'<script type="text/plain" id="licences">\n{_text(licence)}\n</script>',
            f'<script type="text/plain" id="scene">\n{pack_payload(recorder.commands, describe_show(scene))}',
            f"</script>\n<script>\n{_text(bundle)}\n</script>",
            f"<script>\n{_text(here.with_name('preview.js'))}</script>",
            "</body>\n</html>\n",
        ]
    )


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


class Recorder:
    """Replaces meshcat's window: keeps the commands, so that no server process is needed."""

    def __init__(self) -> None:
        self.commands: list[bytes] = []

    def send(self, command: Any) -> None:
        """Keep a command as the bytes that a browser would get."""
        self.commands.append(import_module("umsgpack").packb(command.lower()))


def pack_payload(commands: Sequence[bytes], head: dict[str, Any]) -> str:
    """Pack a scene by gzip and base64, always to the same text.

    Parameters
    ----------
    commands : as packed by meshcat
    head : further data for the page's script; the lengths of the commands are added

    Returns
    -------
    Four bytes with the length of the head (little-endian), the head as JSON, and all commands
    """
    text = json.dumps(head | {"lengths": [len(c) for c in commands]}, separators=(",", ":")).encode()
    content = len(text).to_bytes(4, "little") + text + b"".join(commands)
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")


def describe_show(scene: Scene) -> dict[str, Any]:
    """Collect the data for the page's script: arrangements, copies, and times of the key frames."""
    frames = scene.sides[0].frames
    return {
        "root": f"/meshcat/{ROOT}",
        "layout": _arrangement(scene.layout),
        "machine_layout": _arrangement(scene.layout.with_machine()),
        "copies": scene.copies,
        "duration": max(_round(side.frames.times[-1]) for side in scene.sides),
        "pace": _round(frames.pace),
        "times": [_round(time) for time in frames.times],
        "rows": frames.rows.tolist(),
    }


def _arrangement(layout: Layout) -> dict[str, list[float]]:
    return {
        "together": _matrix(layout.together()),
        "apart": _matrix(layout.apart()),
        "shift": _matrix(layout.shift()),
    }


def _matrix(transform: Any) -> list[float]:
    """Flatten a transform column by column, as three.js reads it."""
    return [float(x) for x in transform.T.reshape(-1)]


def _round(value: float) -> float:
    return float(f"{float(value):.{DIGITS}g}")
