"""The page: first the three answers, then the findings, then the evidence."""

from __future__ import annotations

import logging
import math
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from fiveaxis.files import write_atomically
from fiveaxis.posture import Solution
from fiveaxis.report import tables
from fiveaxis.report.chart import THIN_SPACE
from fiveaxis.report.cutters import what_stays
from fiveaxis.report.figures import axis_lines, energy_bars, power_lines, speed_lines, spending_lines
from fiveaxis.report.landscape import (
    FIRST_STEP,
    MOST_LOCATIONS,
    SECOND_STEP,
    Admits,
    feed_mm_min,
    posture_map,
    surface_at,
)
from fiveaxis.report.maps import posture_map_figure, surface_figure
from fiveaxis.report.questions import best_baseline
from fiveaxis.report.sections import answers_section, front_section, program_section, setup_section
from fiveaxis.report.tables import scroll

logger = logging.getLogger(__name__)

# The browser applies only the page's own style, runs only its own script, and fetches nothing.
POLICY = (
    "default-src 'none'; style-src {style}; script-src {script}; img-src data:; base-uri 'none'; "
    "form-action 'none'"
)


def write_report(
    solution: Solution, document: Mapping[str, Any], path: str | Path, *, admits: Admits | None = None
) -> Path:
    """Write a run's page: one file without network access, the same bytes for the same inputs.

    Parameters
    ----------
    solution : the result with its baselines, for the figures
    document : `report_document` of the same solution, for texts and tables
    path : the ``.html`` file
    admits : checks, for locations (m,) and rotary angles (m, 2), rad, which postures are clear of collisions

    Raises
    ------
    SettingError
        The file can't be written there.
    """
    page = compose_page(solution, document, admits)
    logger.info("%s: %d kB about %d locations", Path(path).name, len(page) // 1000, document["locations"])
    return write_atomically(path, page)


def compose_page(solution: Solution, document: Mapping[str, Any], admits: Admits | None = None) -> str:
    """Compose the page as HTML text."""
    room = files("fiveaxis.report")
    template = Template(room.joinpath("page.html").read_text(encoding="utf-8"))
    best = best_baseline(document)
    baseline = None if best is None else best[0]
    style, script = (room.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    body = template.substitute(
        heading=escape(document["toolpath"]),
        facts=_facts(document),
        answers=answers_section(document),
        compared=_compared(document),
        setup=setup_section(document.get("setup_search")) + front_section(document.get("front")),
        energy=_energy(solution, document, baseline),
        budget=_budget(document),
        motion=_motion(solution, document, baseline),
        posture=_posture(solution, baseline, admits),
        findings=_findings(document),
        checked=_checked(document),
        solver=_solver(document),
        machine=_machine(document),
        inputs=scroll(tables.input_table(document["inputs"])),
    )
    return page_of(document["toolpath"], style, script, body)


def page_of(title: str, style: str, script: str, body: str) -> str:
    """Return a page whose own style and script a browser knows by their hashes; it accepts nothing else.

    Parameters
    ----------
    title : plain text
    body : HTML, with text from files escaped
    """
    shell = Template(files("fiveaxis.report").joinpath("shell.html").read_text(encoding="utf-8"))
    policy = POLICY.format(style=_digest(style), script=_digest(script))
    return shell.substitute(title=escape(title), policy=policy, style=style, script=script, body=body)


def _digest(text: str) -> str:
    """Return the hash by which a content security policy knows an inline style or script."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def _facts(document: Mapping[str, Any]) -> str:
    machine, tilt = document["machine"], document["tilt"]
    return escape(
        f"{tables.number(document['locations'])} locations · {document['tool_in_words']} · "
        f"machine {machine['name']} (code {machine['code']}, axes {' '.join(machine['axes'])}) · "
        f"tool axis {tables.plain(tilt['low'])}…{tables.plain(tilt['high'])}° from the {tilt['reference']}"
    )


def _compared(document: Mapping[str, Any]) -> str:
    if not document["baselines"]:
        return (
            f"<p>There is no baseline to compare with.</p>\n{_missing(document)}{program_section(document)}"
        )
    return (
        f"{scroll(tables.baseline_table(document))}\n{_missing(document)}\n{_measures(document)}"
        f"{program_section(document)}"
    )


def _missing(document: Mapping[str, Any]) -> str:
    items = tables.missing_list(document)
    return f'<ul class="small">\n{items}\n</ul>' if items else ""


def _measures(document: Mapping[str, Any]) -> str:
    base = document["machine"]["base_power"]
    with_base = (
        "The machine’s base power isn’t known, so totals with base power can’t be computed; a posture that "
        "takes longer may cost more than it saves."
        if base is None
        else f"With base power: plus {tables.number(base)} W over the cycle time."
    )
    error = document["energy"]["travel_error"]
    difference = (
        ""
        if error is None
        else "For the result the metric is off the energy by "
        f"{tables.number(100.0 * error, 1, signed=True)}{THIN_SPACE}%. "
    )
    return (
        '<p class="small">Energy: ∫P dt of the feed drives over the duration of each block; a drive with '
        "constant power pays for the whole block, however short its own travel. The lower energy applies if "
        "a drive’s power falls in proportion to its speed below the slowest measured speed. Travel metric: "
        "every axis is charged for its travel at the programmed feed (Σ W|Δq|). None of them includes "
        f"spindle, coolant or cutting power. {difference}{with_base}{_left(document)}</p>"
    )


def _left(document: Mapping[str, Any]) -> str:
    """Say how much any posture could still save; empty without a lower bound."""
    bound = document["bound"]
    if bound is None:
        return ""
    words = bound["in_words"]
    return f" {words[0].upper()}{words[1:]} (certified lower bound: {tables.number(bound['total'])} J)."


def _energy(solution: Solution, document: Mapping[str, Any], baseline: str | None) -> str:
    compared = "the result" if baseline is None else f"“{escape(baseline)}” and of the result"
    return (
        _figure(energy_bars(solution, baseline), f"Energy of {compared} by axis; feed drives only.")
        + scroll(tables.axis_table(document, baseline))
        + _figure(
            spending_lines(solution, baseline), "The same energy, added up along the path; feed drives only."
        )
    )


def _budget(document: Mapping[str, Any]) -> str:
    """Write the electricity of the whole job; empty if it wasn't computed."""
    budget = document["budget"]
    if budget is None:
        return ""
    text = f"Together {tables.number(budget['total'])} J ({budget['kWh']:.4f} kWh) in {budget['time']:.1f} s"
    text += "" if budget["complete"] else ", without the consumers that aren’t known"
    if budget["cost"] is not None:
        text += f"; {budget['cost']:.4f} {budget['currency']}"
    if budget["co2_kg"] is not None:
        text += f"; {1000.0 * budget['co2_kg']:.1f} g CO₂"
    heading = "<h2>Electricity of the whole job</h2>"
    return f"<section>\n{heading}\n{scroll(tables.budget_table(budget))}\n<p>{escape(text)}.</p>\n</section>"


def _motion(solution: Solution, document: Mapping[str, Any], baseline: str | None) -> str:
    events = (
        "A start: the axis moves in a block, and stood in the one before. A reversal: it moves against its "
        "direction in the block before. Change of speed: the largest from one cutting block to the next, by "
        "the blocks’ mean speeds. Approach and retract aren’t counted."
    )
    caption = (
        "Axis values along the path, tool relative to workpiece; rotary axes accumulate their turns. Last "
        f"band: angle between tool axis and {solution.tilt.name}, its bounds dotted. Long paths are thinned; "
        "the highest and lowest values are kept."
    )
    speeds = (
        "Over time instead of along the path: the mean speed of every axis in each move, as limited by the "
        "feed and the slowest axis; the machine’s highest speeds are dotted where the motion comes near them."
    )
    powers = (
        "Power of each feed drive at those speeds, and of all together, without base load, spindle and "
        "acceleration. The area under the last band is the power integral."
    )
    return (
        scroll(tables.steadiness_table(document, baseline))
        + f'<p class="small">{escape(events)}</p>\n'
        + _figure(axis_lines(solution, baseline), escape(caption))
        + _figure(speed_lines(solution, baseline), escape(speeds))
        + _figure(power_lines(solution, baseline), escape(powers))
    )


def _posture(solution: Solution, baseline: str | None, admits: Admits | None) -> str:
    surface = surface_at(solution, len(solution.toolpath) // 2)
    return _figure(
        posture_map_figure(solution, posture_map(solution, admits), baseline),
        escape(_map_caption(solution, admits is not None)),
    ) + _figure(
        surface_figure(solution, surface, baseline), escape(_surface_caption(solution, surface.location))
    )


def _map_caption(solution: Solution, knows_collisions: bool) -> str:
    first, second = solution.machine.rotaries
    n = len(solution.toolpath)
    collisions = (
        f"Hatched: only collisions of the tool or its holder rule out every {second}, by a map of directions "
        "with a grid of some degrees."
        if knows_collisions
        else "Collisions aren’t in this map."
    )
    sampled = "" if n <= MOST_LOCATIONS else f" {MOST_LOCATIONS} of {tables.number(n)} locations are sampled."
    return (
        f"Colour: energy of a move from axis zero to this location with {first} as on the left and the "
        f"cheapest {second} that tilt and axis limits admit (S_W, feed drives only). The chosen "
        f"{second} may be another one: the optimiser minimises the change from location to location, not the "
        f"height. Grey: no {second} is admissible. {first} is shown without whole turns; grid "
        f"{FIRST_STEP:g}° × {SECOND_STEP:g}°, median feed {feed_mm_min(solution):.0f} mm/min.{sampled} "
        f"{collisions}"
    )


def _surface_caption(solution: Solution, location: int) -> str:
    first, second = solution.machine.rotaries
    return (
        f"Energy of a move from axis zero to location {location}, the middle of the path, for every pair of "
        f"{first} and {second}. {what_stays(solution.toolpath.tool)} (S_W, feed drives only). A "
        "move costs the change between two postures, not the height. Collisions aren’t in this map."
    )


def _findings(document: Mapping[str, Any]) -> str:
    summary = document["summary"]
    if not summary:
        return "<p>No findings.</p>"
    total = tables.number(sum(cause["count"] for cause in summary))
    listed = tables.number(len(document["findings"]))
    head = f"{total} findings, one row for each cause; the JSON report lists {listed} places."
    return f"<p>{escape(head)}</p>\n{scroll(tables.causes_table(summary))}"


def _checked(document: Mapping[str, Any]) -> str:
    verification = document["verification"]
    items = "\n".join(f"<li>{escape(sentence)}</li>" for sentence in verification["checked"])
    listed = f'<ul class="small">\n{items}\n</ul>\n' if items else "<p>Nothing was checked.</p>\n"
    return f"{listed}{scroll(tables.measured_table(verification['figures']))}"


def _solver(document: Mapping[str, Any]) -> str:
    residuals = document["residuals"]
    audit = (
        f"Residuals of the result: tilt overrun {math.degrees(residuals['tilt']):.2g}°, limit "
        f"overrun {residuals['limit']:.2g} mm or rad, contact error {residuals['contact']:.2g} mm."
    )
    kkt = document.get("kkt")
    if kkt is not None:
        audit += (
            f" Residuals of the optimality conditions: {kkt['dual']:.2g} J/rad, bounds violated by "
            f"{kkt['primal']:.2g}, complementarity {kkt['complementarity']:.2g} J."
        )
    return f'{scroll(tables.solver_table(document["solver"]))}\n<p class="small">{escape(audit)}</p>'


def _machine(document: Mapping[str, Any]) -> str:
    machine = document["machine"]
    figures = machine["figures"]
    assumed = sum(f["assumed"] for f in figures)
    text = f"{machine['description'] or machine['name']}. "
    text += (
        f"{assumed} of {len(figures)} figures are assumed, not measured or printed; the results rest on them."
        if assumed
        else "No figure is assumed."
    )
    if machine["tool_length"]:
        text += f" The tool is {machine['tool_length']:g} mm long from the spindle's gauge point to its tip."
    setup = machine["setup"]
    if any((*setup["offset"], *setup["rotation_deg"])):
        text += (
            f" The workpiece's zero is at ({tables.plain_list(setup['offset'])}) mm in the machine frame, "
            f"turned by ({tables.plain_list(setup['rotation_deg'])}) deg about the machine's X, Y, Z."
        )
    return f"<p>{escape(text)}</p>\n{scroll(tables.machine_table(figures))}"


def _figure(content: str, caption: str) -> str:
    return f"<figure>\n{content}\n<figcaption>{caption}</figcaption>\n</figure>\n"
