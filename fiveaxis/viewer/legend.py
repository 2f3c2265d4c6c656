"""The page's texts, legend and controls. Text from files is escaped."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.findings import Finding, group_findings
from fiveaxis.viewer.lines import VIRIDIS
from fiveaxis.viewer.scene import Scene
from fiveaxis.viewer.tool_motion import Side

if TYPE_CHECKING:
    from fiveaxis.posture.solution import Solution

# Marks the box of an object that is shown a second time beside the baseline.
COPIED = ' data-copied="yes"'
# Speeds of the show, as multiples of the programmed one.
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
# Only speeds within this factor of the initial one are offered.
RANGE = 10.0


def title_of(solution: Solution) -> str:
    """Return the path's name, without its folder, as HTML."""
    return html.escape(Path(solution.toolpath.name).name)


def make_legend(solution: Solution, scene: Scene, findings: Sequence[Finding]) -> str:
    """Return the legend as HTML."""
    lines = [
        f"<h1>{title_of(solution)}</h1>",
        f"<p>{len(solution.toolpath)} locations, {html.escape(solution.machine.name)}</p>",
        f"<p>{'<br>'.join(_figures(side) for side in scene.sides)}<br>energy of the feed drives</p>",
        *_views(scene),
        f"<p>{''.join(_boxes(scene))}</p>",
        *_remarks(solution, scene),
        *_scale(scene.top),
        *_listed(findings, scene),
    ]
    return '<div id="legend">' + "\n".join(lines) + "</div>"


def make_controls(pace: float) -> str:
    """Return the bar below the scene as HTML: play and pause, the time slider, the speed.

    Parameters
    ----------
    pace : initial machine seconds per second of the show, which the speeds are multiples of
    """
    offered = sorted({pace, *(s for s in SPEEDS if pace / RANGE <= s <= pace * RANGE or s == 1.0)})
    speeds = "".join(
        f'<option value="{speed / pace:.6g}"{" selected" if speed == pace else ""}>{speed:.3g}×</option>'
        for speed in offered
    )
    return (
        '<div id="controls"><button id="play" type="button">pause</button>'
        '<input id="time" type="range" min="0" max="1" step="any" value="0" aria-label="time">'
        f'<select id="speed" aria-label="speed, of the programmed one" title="of the programmed speed">'
        f'{speeds}</select><span id="clock"></span></div>'
    )


def _figures(side: Side) -> str:
    """Return energy and time of a side."""
    time = float(side.motion.time.sum())
    return f"{html.escape(side.name)} {side.energy:,.0f} J, {time:,.1f} s"


def _views(scene: Scene) -> list[str]:
    if len(scene.sides) < 2:
        return []
    before = scene.sides[1].name
    views = {
        "after": "result",
        "before": before,
        "both": "both at one place",
        "apart": f"side by side, {before} on the left",
    }
    chosen = "".join(
        f'<label><input type="radio" name="view" value="{value}"{" checked" if value == "after" else ""}> '
        f"{html.escape(label)}</label>"
        for value, label in views.items()
    )
    return [f"<p>{chosen}</p>"]


def _boxes(scene: Scene) -> list[str]:
    """Return a check box for every object that can be hidden."""
    copied = len(scene.sides) > 1
    wanted = [
        ("part", "part", scene.has_part, True, copied),
        ("stock", "stock", scene.has_stock, False, copied),
        ("fixtures", "fixtures", bool(scene.fixtures), True, copied),
        ("machine", "machine", scene.has_machine, False, copied),
        ("findings", "after/marks", scene.has_marks, True, False),
    ]
    return [
        f'<label><input type="checkbox" value="{node}"{" checked" * shown}{COPIED * twice}> {label}</label>'
        for label, node, there, shown, twice in wanted
        if there
    ]


def _remarks(solution: Solution, scene: Scene) -> list[str]:
    """Return the remarks on pace, fixtures and holder."""
    remarks = []
    pace = scene.sides[0].frames.pace
    if round(pace, 1) > 1.0:
        remarks.append(f"initially shown {pace:.3g} times as fast as programmed")
    if scene.fixtures:
        remarks.append("fixtures: " + ", ".join(scene.fixtures))
    if solution.toolpath.tool.holder is None:
        remarks.append("no holder is known; the shank's length is assumed")
    return [f"<p>{html.escape(line)}</p>" for line in remarks]


def _scale(top: float) -> list[str]:
    stops = ", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255.0 * stop)) for stop in VIRIDIS)
    return [
        f'<div id="scale" style="background: linear-gradient(to right, {stops})"></div>',
        f'<div id="ends"><span>0</span><span>{top:.3g} W and more, feed drives in a cut</span></div>',
    ]


def _portable(finding: Finding) -> Finding:
    """Remove the folder from a finding's file name, as the page may be passed on."""
    file = finding.place.file
    return finding if file is None else replace(finding, place=replace(finding.place, file=Path(file).name))


def _listed(findings: Sequence[Finding], scene: Scene) -> list[str]:
    """List findings by cause, each a button that takes the show to the worst location, if there is one."""
    if not findings:
        return []
    entries = []
    for cause in group_findings(map(_portable, findings)):
        time = scene.sides[0].when_shown(cause.worst)
        when = "" if time is None else f' data-time="{time:.3f}"'
        entries.append(
            f'<button type="button" class="{cause.severity}"{when}>{html.escape(str(cause))}</button>'
        )
    inside = "\n".join(entries)
    return [f'<details id="findings"><summary>{len(findings)} findings</summary>\n{inside}</details>']
