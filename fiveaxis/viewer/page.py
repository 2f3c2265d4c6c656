"""The simulation as one HTML page that needs no network and no server, with everything packed in it."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.files import write_atomically
from fiveaxis.viewer.legend import make_controls, make_legend, make_readings, title_of
from fiveaxis.viewer.library import load_meshcat
from fiveaxis.viewer.moves import NO_LINE, ShownProgram, choose_sides
from fiveaxis.viewer.payload import Recorder, describe_show, pack_payload
from fiveaxis.viewer.scene import build_scene

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
# In this order: each uses the ones before.
SCRIPTS = ("data.js", "chain.js", "stage.js", "readings.js", "timeline.js", "main.js")


def write_preview(
    solution: Solution,
    path: str | Path,
    *,
    program: ShownProgram | None = None,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> Path:
    """Write the simulation as one HTML page that works offline; the same solution gives the same bytes.

    Parameters
    ----------
    solution : to show
    path : of the page
    program : of the solution, as `make_program` makes it: its moves and blocks are shown instead of the
        path's locations
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
    page = render_page(solution, program=program, part=part, surroundings=surroundings, findings=findings)
    logger.info("%s: %d kB", Path(path).name, len(page) // 1000)
    return write_atomically(path, page)


def render_page(
    solution: Solution,
    *,
    program: ShownProgram | None = None,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> str:
    """Return the text of the page that `write_preview` writes."""
    meshcat = load_meshcat()
    recorder = Recorder()
    sides = choose_sides(solution, program)
    vis = meshcat.Visualizer(window=recorder)
    scene = build_scene(vis, solution, sides, part, surroundings=surroundings, findings=findings)
    has_text = program is not None and bool((sides[0].line != NO_LINE).any())
    text = program.text.lines if program is not None and has_text else ()
    bounds = math.degrees(solution.tilt.low), math.degrees(solution.tilt.high)
    head, sections = describe_show(solution.machine, scene, sides, text, bounds)
    logger.debug("%d messages to the scene; %d findings", len(recorder.commands), len(findings))
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    licence = bundle.with_name("main.min.js.LICENSE.txt").read_text(encoding="utf-8")
    scripts = "".join(f"<script>\n{_own(name)}</script>\n" for name in SCRIPTS)
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
            f"<title>{title_of(solution)}: fiveaxis simulation</title>",
            f"<style>\n{_own('page.css')}</style>\n</head>\n<body>",
            '<main id="meshcat-pane" aria-label="machine, workpiece and tool"></main>',
            make_legend(solution, scene, sides, findings, head["top"]),
            make_readings(solution.machine),
            make_controls(solution.machine),
            '<div id="fault" role="alert" hidden></div>',
            f'<script type="text/plain" id="licences">\n{licence}\n</script>',
            f'<script type="text/plain" id="scene">\n{pack_payload(recorder.commands, sections, head)}',
            f"</script>\n<script>\n{bundle.read_text(encoding='utf-8')}\n</script>",
            f"{scripts}</body>\n</html>\n",
        ]
    )


def _own(name: str) -> str:
    return files("fiveaxis.viewer").joinpath("scripts", name).read_text(encoding="utf-8")
