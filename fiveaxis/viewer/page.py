"""The scene as one HTML page that needs no network and no server."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.files import write_atomically
from fiveaxis.viewer.legend import make_controls, make_legend, title_of
from fiveaxis.viewer.library import load_meshcat
from fiveaxis.viewer.payload import Recorder, describe_show, pack_payload
from fiveaxis.viewer.scene import build_scene

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.collision import Surroundings
    from fiveaxis.findings import Finding
    from fiveaxis.posture.solution import Solution

logger = logging.getLogger(__name__)

# The page may run what it carries and fetch nothing: a browser holds it to that.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'"
)


def write_preview(
    solution: Solution,
    path: str | Path,
    *,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> Path:
    """Write the scene as one HTML page that works offline.

    The same solution gives the same bytes.

    Parameters
    ----------
    solution : what to show
    path : of the page
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures to show
    findings : of verification, on the solution's motion

    Raises
    ------
    MeshError
        The part, a fixture's mesh or one of the machine can't be read.
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
    """Make the page's text; see `write_preview`."""
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
