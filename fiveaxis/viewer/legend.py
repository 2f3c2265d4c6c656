"""The page's texts and controls as HTML. Text from files is escaped."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.findings import Finding, group_findings
from fiveaxis.machine import Machine
from fiveaxis.viewer.moves import Side
from fiveaxis.viewer.power_scale import VIRIDIS
from fiveaxis.viewer.scene import Scene

if TYPE_CHECKING:
    from fiveaxis.posture.solution import Solution

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
            ("asked", "feed wanted"),
            ("got", "feed got"),
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
    others = "; those of a baseline beside the result in the grey half of each row"
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
        '<p><label>beside the result <select id="beside"><option value="">nothing</option>'
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
