"""The simulation as one HTML page that needs no network and no server, with everything packed in it.

Text from files is escaped.
"""

from __future__ import annotations

import html
import logging
import math
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.files import write_atomically
from fiveaxis.findings import Finding, group_findings
from fiveaxis.machine import Machine
from fiveaxis.viewer.moves import NO_LINE, ShownProgram, Side, choose_sides
from fiveaxis.viewer.payload import VIRIDIS, Recorder, describe_show, pack_payload
from fiveaxis.viewer.scene import Scene, build_scene
from fiveaxis.viewer.solids import load_meshcat

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
# Speeds of the show, as multiples of the program's.
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
# Pixels of the time line: its curves, and each axis's row below them (`timeline.js`).
CURVES, AXIS_ROW = 64, 12
KEYS = (
    ("Space", "play or pause"),
    ("← →", "block by block"),
    ("Page ↑ ↓", "ten seconds"),
    ("Home End", "first and last block"),
    ("F", "frame"),
)


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


def title_of(solution: Solution) -> str:
    """Return the path's name, without its folder, as HTML."""
    return html.escape(Path(solution.toolpath.name).name)


def make_legend(
    solution: Solution, scene: Scene, sides: Sequence[Side], findings: Sequence[Finding], top: float
) -> str:
    """Return the legend as HTML: the programs, what can be switched on and off, colours and findings.

    Parameters
    ----------
    top : W, at the end of the colour scale
    """
    lines = [
        f"<h1>{title_of(solution)}</h1>",
        f"<p>{solution.toolpath.count_given} locations, {html.escape(solution.machine.name)}</p>",
        f"<p>{'<br>'.join(_figures(side) for side in sides)}<br>energy of the feed drives, time</p>",
        _events(sides),
        _frames(),
        _beside(sides),
        f"<p>{''.join(_boxes(scene))}</p>",
        *_remarks(solution, scene),
        *_scale(top),
        *_listed(findings, sides[0]),
        _keys(),
    ]
    return '<section id="legend" aria-label="what is shown">' + "\n".join(lines) + "</section>"


def make_readings(machine: Machine) -> str:
    """Return the panel of values at the place shown as HTML; the page's script fills it in."""
    rows = "".join(
        f'<tr data-axis="{number}"><th scope="row">{axis.letter}</th><td class="value"></td>'
        '<td class="range"><meter min="0" max="1" aria-label="place in its travel"></meter></td>'
        '<td class="power"></td><td class="other"></td></tr>'
        for number, axis in enumerate(machine.axes)
    )
    figures = "".join(
        f'<tr data-figure="{name}"><th scope="row">{label}</th><td class="value" colspan="3"></td>'
        '<td class="other"></td></tr>'
        for name, label in (
            ("time", "time"),
            ("location", "location"),
            ("programmed", "programmed feed"),
            ("actual", "actual feed"),
            ("lean", "lean"),
            ("power", "power"),
        )
    )
    return (
        '<section id="readings" aria-label="at the place shown"><p id="block"></p>'
        '<table><thead><tr><th scope="col">axis</th><th scope="col">value</th><th scope="col">travel</th>'
        '<th scope="col">power</th><th scope="col" class="other" id="other-name"></th></tr></thead>'
        f"<tbody>{rows}</tbody><tbody>{figures}</tbody></table></section>"
    )


def make_controls(machine: Machine) -> str:
    """Return the bar below the scene as HTML: time line, play and pause, time, speed."""
    speeds = "".join(f'<option value="{speed}">{speed:g}×</option>' for speed in SPEEDS)
    letters = "".join(f"<span>{axis.letter}</span>" for axis in machine.axes)
    return (
        f'<section id="controls" aria-label="time"><div id="axes" aria-hidden="true">{letters}</div>'
        f'<div id="timeline" style="height: {CURVES + AXIS_ROW * len(machine.axes)}px">'
        '<canvas id="curves" role="img" aria-label="power, feed and findings over time, below them starts '
        'and reversals of each axis"></canvas><div id="cursor"></div></div>'
        '<div id="buttons"><button id="play" type="button">pause</button>'
        '<input id="time" type="range" min="0" max="1" step="any" value="0" aria-label="time">'
        '<select id="speed" aria-label="speed, of the program’s" title="of the program’s speed">'
        f'{speeds}</select><span id="clock"></span></div></section>'
    )


def _figures(side: Side) -> str:
    """Return energy, time, starts and reversals of a side."""
    starts, reversals = (sum(n.values()) for n in (side.steadiness.starts, side.steadiness.reversals))
    counts = f"starts {starts:,}, reversals {reversals:,}"
    return f"{html.escape(side.name)} {side.energy:,.0f} J, {side.time:,.1f} s; {counts}"


def _events(sides: Sequence[Side]) -> str:
    """Explain the marks below the curves of the time line."""
    others = "; those of a baseline beside the optimised program in the grey half of each row"
    return (
        '<p class="small">time line, below the curves, by axis: <span class="start">▮</span> start, '
        f'<span class="reversal">▮</span> reversal{others if len(sides) > 1 else ""}</p>'
    )


def _frames() -> str:
    choices = (("machine", "machine", True), ("part", "part", False))
    inside = "".join(
        f'<label><input type="radio" name="frame" value="{value}"{" checked" * checked}> {label}</label>'
        for value, label, checked in choices
    )
    whole = '<label><input type="checkbox" id="whole"> whole machine</label>'
    return f'<fieldset id="frames"><legend>frame of the</legend>{inside}{whole}</fieldset>'


def _beside(sides: Sequence[Side]) -> str:
    if len(sides) < 2:
        return ""
    options = "".join(
        f'<option value="{number}">{html.escape(side.name)}</option>'
        for number, side in enumerate(sides)
        if number
    )
    return (
        '<p><label>beside the optimised program <select id="beside"><option value="">nothing</option>'
        f"{options}</select></label></p>"
    )


def _boxes(scene: Scene) -> list[str]:
    """Return a check box for every object that can be hidden."""
    wanted = [
        ("part", "workpiece/part", scene.has_part, True),
        ("stock", "workpiece/stock", scene.has_stock, False),
        ("fixtures", "workpiece/fixtures", bool(scene.fixtures), True),
        ("machine", "links", True, True),
        ("tool", "tool", True, True),
        ("findings", "workpiece/marks", scene.has_marks, True),
    ]
    return [
        f'<label><input type="checkbox" data-node="{node}"{" checked" * shown}> {label}</label>'
        for label, node, there, shown in wanted
        if there
    ]


def _remarks(solution: Solution, scene: Scene) -> list[str]:
    """Return the remarks on machine, fixtures and holder."""
    remarks = []
    if scene.is_schematic:
        remarks.append("The machine is a scheme: placed by its chain and travels, with invented thicknesses.")
    if scene.fixtures:
        remarks.append("fixtures: " + ", ".join(scene.fixtures))
    if solution.toolpath.tool.holder is None:
        remarks.append("No holder is known; the shank's length is assumed.")
    return [f'<p class="small">{html.escape(line)}</p>' for line in remarks]


def _scale(top: float) -> list[str]:
    stops = ", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255.0 * stop)) for stop in VIRIDIS)
    return [
        f'<div id="scale" style="background: linear-gradient(to right, {stops})"></div>',
        f'<div id="ends"><span>0</span><span>{top:,.0f} W and more, feed drives in a cut</span></div>',
    ]


def _portable(finding: Finding) -> Finding:
    """Remove the folder from a finding's file name, as the page may be passed on."""
    file = finding.place.file
    return finding if file is None else replace(finding, place=replace(finding.place, file=Path(file).name))


def _listed(findings: Sequence[Finding], result: Side) -> list[str]:
    """List findings by cause, each a button that goes to the worst place, if there is one."""
    if not findings:
        return []
    entries = []
    for cause in group_findings(map(_portable, findings)):
        row = result.row_of(cause.worst)
        where = "" if row is None else f' data-row="{row}"'
        entries.append(
            f'<button type="button" class="{cause.severity}"{where}>{html.escape(str(cause))}</button>'
        )
    inside = "\n".join(entries)
    return [f'<details id="findings"><summary>findings: {len(findings)}</summary>\n{inside}</details>']


def _keys() -> str:
    rows = "".join(f"<dt>{key}</dt><dd>{what}</dd>" for key, what in KEYS)
    return f'<details id="keys"><summary>keys</summary><dl>{rows}</dl></details>'
