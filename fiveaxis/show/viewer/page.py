"""The simulation as one HTML page that needs no network, with everything packed in it.

It is written to a file here, and served by `serving`. Text from files is escaped.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from html import escape
from importlib.metadata import distribution
from importlib.resources import files
from pathlib import Path
from string import Template

from fiveaxis.base import Finding, group_findings, keywords_of, write_atomically
from fiveaxis.posture import Optimum
from fiveaxis.show.viewer.moves import Side
from fiveaxis.show.viewer.payload import VIRIDIS, describe_show, pack_payload
from fiveaxis.show.viewer.recorder import Recorder
from fiveaxis.show.viewer.scene import STOCK_COLOUR, Scene, build_scene
from fiveaxis.show.viewer.shown import Beside, Shown, WholeProgram, shown_of
from fiveaxis.show.viewer.stock import PlayedStock

logger = logging.getLogger(__name__)

# In this order: each uses the ones before.
SCRIPTS = (
    *("data.js", "chain.js", "stage.js", "stock.js", "readings.js", "timeline.js", "lines.js"),
    *("camera.js", "main.js"),
)
# Pixels of the time line: its curves, and each axis's row below them (`timeline.js`).
CURVES, AXIS_ROW = 64, 12


@keywords_of(Beside)
def write_preview(solution: Optimum | WholeProgram, path: str | Path, given: Beside) -> Path:
    """Write the simulation as one HTML page that works offline; the same solution gives the same bytes.

    Parameters
    ----------
    solution : to show; or a program as it is, with its own surroundings and findings (`show_program`)
    path : of the page
    program : of the solution, as `make_program` makes it: its moves and blocks are shown instead of the
        path's locations
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures to show
    findings : of verification, on the solution's motion
    cad : how a file of the part is taken

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    SettingError
        The page can't be written there; neither a solution nor a program.
    """
    page = render_page(solution, given)
    logger.info("%s: %d kB", Path(path).name, len(page) // 1000)
    return write_atomically(path, page)


def render_page(solution: Optimum | WholeProgram, given: Beside = Beside()) -> str:
    """Return the text of the page that `write_preview` writes."""
    shown = shown_of(solution, given)
    recorder, result, cutting = Recorder(), shown.sides[0], shown.cutting
    scene = build_scene(recorder, shown)
    head, sections = describe_show(shown, scene)
    blank, played = shown.surroundings.blank, None
    if blank is not None and cutting is not None:
        played = PlayedStock.of(blank, cutting, shown.machine, shown.cut)
        head["stock"] = played.describe(sections) | {"colour": STOCK_COLOUR}
    logger.debug("%d messages to the scene; %d findings", len(recorder.commands), len(shown.findings))
    axes = shown.machine.axes
    others = "; those of a baseline beside the optimised program in the grey half of each row"
    return Template(_own("page.html")).substitute(
        title=escape(Path(shown.toolpath.name).name),
        style=_own("page.css"),
        facts=f"{shown.toolpath.count_given} locations, {escape(shown.machine.name)}",
        programs="<br>".join(_figures(side) for side in shown.sides),
        others=others if len(shown.sides) > 1 else "",
        beside=_beside(shown.sides),
        boxes="".join(_boxes(shown, scene)),
        map="" if played is None else _map(played),
        remarks="\n".join(_remarks(shown, scene)),
        stops=", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255.0 * stop)) for stop in VIRIDIS),
        top=f"{head['top']:,.0f}",
        findings=_listed(shown.findings, result) if shown.findings else "",
        axes="".join(_reading(number, axis.letter) for number, axis in enumerate(axes)),
        letters="".join(f"<span>{axis.letter}</span>" for axis in axes),
        height=CURVES + AXIS_ROW * len(axes),
        licences=_meshcat("main.min.js.LICENSE.txt"),
        scene=pack_payload(recorder.commands, sections, head),
        meshcat=_meshcat("main.min.js"),
        scripts="".join(f"<script>\n{_own(name)}</script>\n" for name in SCRIPTS),
    )


def _meshcat(name: str) -> str:
    """Return a file of meshcat's page; the library itself would import a server and a notebook."""
    file = distribution("meshcat").locate_file(f"meshcat/viewer/dist/{name}")
    return Path(str(file)).read_text(encoding="utf-8")


def _own(name: str) -> str:
    return files("fiveaxis.show.viewer").joinpath("scripts", name).read_text(encoding="utf-8")


def _reading(number: int, letter: str) -> str:
    """Return an axis's row in the panel of values as HTML; the page's script fills it in."""
    return (
        f'<tr data-axis="{number}"><th scope="row">{letter}</th><td class="value"></td>'
        '<td class="range"><meter min="0" max="1" aria-label="place in its travel"></meter></td>'
        '<td class="power"></td><td class="other"></td></tr>'
    )


def _figures(side: Side) -> str:
    starts, reversals = (sum(n.values()) for n in (side.steadiness.starts, side.steadiness.reversals))
    counts = f"starts {starts:,}, reversals {reversals:,}"
    return f"{escape(side.name)} {side.energy:,.0f} J, {side.time:,.1f} s; {counts}"


def _beside(sides: Sequence[Side]) -> str:
    if len(sides) < 2:
        return ""
    options = "".join(
        f'<option value="{number}">{escape(side.name)}</option>'
        for number, side in enumerate(sides)
        if number
    )
    return (
        '<p><label>beside the optimised program <select id="beside"><option value="">nothing</option>'
        f"{options}</select></label></p>"
    )


def _boxes(shown: Shown, scene: Scene) -> list[str]:
    around, cut = shown.surroundings, shown.surroundings.blank is not None
    wanted = [
        ("part", "workpiece/part", shown.part is not None, not cut),
        ("face numbers", "workpiece/numbers", scene.has_numbers, False),
        ("stock", "workpiece/stock", around.stock is not None, cut),
        ("path", "workpiece/path", True, True),
        ("fixtures", "workpiece/fixtures", bool(around.fixtures), True),
        ("machine", "links", True, True),
        ("tool", "tool", True, True),
        ("findings", "workpiece/marks", scene.has_marks, True),
    ]
    return [
        f'<label><input type="checkbox" data-node="{node}"{" checked" * seen}> {label}</label>'
        for label, node, there, seen in wanted
        if there
    ]


def _map(played: PlayedStock) -> str:
    """Return the switch for the colours of the finished part, with their meaning; empty if it has none."""
    if not played.is_compared:
        return ""
    key = ", ".join(
        f'<span style="color: rgb{colour}">▮</span> {escape(text)}' for colour, text in played.key().items()
    )
    return (
        '<p><label><input type="checkbox" id="map" checked> map of the finished part</label></p>'
        f'<p class="small" id="map-key">{key}</p>'
    )


def _remarks(shown: Shown, scene: Scene) -> list[str]:
    remarks, fixtures = [], [fixture.name for fixture in shown.surroundings.fixtures]
    if not shown.machine.bodies:
        remarks.append("The machine is a scheme: placed by its chain and travels, with invented thicknesses.")
    if scene.assumed:
        remarks.append(f"Brown-red: {' and '.join(scene.assumed)}, checked in place of [[bodies]].")
    if fixtures:
        remarks.append("fixtures: " + ", ".join(fixtures))
    remarks += [f"Assumed: {sentence}." for sentence in shown.assumed]
    if shown.toolpath.tool.holder is None:
        remarks.append("No holder is known; the shank's length is assumed.")
    return [f'<p class="small">{escape(line)}</p>' for line in remarks]


def _listed(findings: Sequence[Finding], result: Side) -> str:
    entries = []
    for cause in group_findings(finding.portable() for finding in findings):
        row = result.row_of(cause.worst)
        where = "" if row is None else f' data-row="{row}"'
        entries.append(f'<button type="button" class="{cause.severity}"{where}>{escape(str(cause))}</button>')
    inside = "\n".join(entries)
    return f'<details id="findings"><summary>findings: {len(findings)}</summary>\n{inside}</details>'
