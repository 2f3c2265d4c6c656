"""The page: first the three answers, then the findings, then the evidence."""

from __future__ import annotations

import logging
import math
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, product, require_suffix, write_atomically
from fiveaxis.check import DEEP, HIGH, CutStock, Deviations, colours_of
from fiveaxis.lab import STEP, Budget, CutCourse
from fiveaxis.model import Machine
from fiveaxis.posture import Optimum
from fiveaxis.show.report import tables
from fiveaxis.show.report.document import ReportDocument
from fiveaxis.show.report.figures import (
    axis_lines,
    cut_lines,
    energy_bars,
    power_lines,
    speed_lines,
    spending_lines,
)
from fiveaxis.show.report.landscape import FIRST_STEP, MOST_LOCATIONS, SECOND_STEP, Admits, feed_mm_min
from fiveaxis.show.report.maps import draw_location, draw_valley, png_address
from fiveaxis.show.report.plots import page_of
from fiveaxis.show.report.sections import (
    answers_section,
    edge_section,
    front_section,
    limit_strips,
    program_section,
    setup_section,
)
from fiveaxis.show.report.surfaces import location_surface, path_valley
from fiveaxis.show.report.tables import scroll
from fiveaxis.show.report.words import THIN_SPACE, number, plain, plain_list, what_stays

logger = logging.getLogger(__name__)

# Directions from which the part is looked at, and what they are called.
VIEWS = {
    "from the left, in front": (-1.0, -1.0, 0.8),
    "from the right, behind": (1.0, 1.0, 0.8),
    "from above": (0.0, 0.0, 1.0),
    "from below": (0.0, 0.0, -1.0),
}
# Pixels along the longest side of a view.
PIXELS = 260


def write_report(document: ReportDocument, path: str | Path, *, admits: Admits | None = None) -> Path:
    """Write a run's page: one file without network access, the same bytes for the same inputs.

    `admits` checks, for locations (m,) and rotary angles (m, 2), rad, which postures are clear of collisions.
    """
    page = compose_page(document, admits)
    logger.info("%s: %d kB about %d locations", Path(path).name, len(page) // 1000, document.locations)
    return write_atomically(path, page)


def compose_page(document: ReportDocument, admits: Admits | None = None) -> str:
    """Compose the page as HTML text."""
    solution, baseline = document.solution, document.baseline
    room = files("fiveaxis.show.report")
    template = Template(room.joinpath("page.html").read_text(encoding="utf-8"))
    style, script = (room.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    body = template.substitute(
        heading=escape(document.name),
        facts=_facts(document),
        answers=answers_section(document),
        compared=_compared(document),
        setup=setup_section(document.setup_search) + front_section(document.front) + edge_section(document),
        programs=f"{'' if baseline is None else f'“{escape(baseline)}” and of '}the optimised program",
        axis_table=scroll(tables.axis_table(document)),
        budget=_budget(document.budget),
        steadiness_table=scroll(tables.steadiness_table(document)),
        reference=escape(solution.tilt.name),
        findings=_findings(document),
        checked=_checked(document),
        finished=finished_section(document.verdict.cut),
        solver=_solver(document),
        machine=_machine(document.machine),
        inputs=scroll(tables.input_table(document.inputs)),
        time_caption=escape(_time_caption(document)),
        energy_bars=energy_bars(solution, baseline),
        spending_lines=spending_lines(solution, baseline),
        limit_strips=limit_strips(solution, document.timed_against),
        axis_lines=axis_lines(solution, baseline),
        speed_lines=speed_lines(solution, baseline),
        power_lines=power_lines(solution, baseline),
        **_posture(solution, admits),
    )
    return page_of(document.name, style, script, body)


def write_finished(cut: CutStock, path: str | Path, title: str) -> Path:
    """Write a page, ``.html``, of the finished part alone."""
    require_suffix(path, (".html",), "the map of a finished part")
    style = files("fiveaxis.show.report").joinpath("page.css").read_text(encoding="utf-8")
    body = f"<main>\n<h1>{escape(title)}</h1>\n{finished_section(cut)}\n</main>"
    return write_atomically(path, page_of(title, style, "", body))


def _facts(document: ReportDocument) -> str:
    machine, solution = document.machine, document.solution
    low, high = map(plain, document.tilt)
    return escape(
        f"{number(document.locations)} locations · {document.tool} · "
        f"machine {machine.name} (code {machine.code}, axes {' '.join(machine.letters)}) · "
        f"tool axis {low}…{high}° from the {solution.tilt.name}"
    )


def _time_caption(document: ReportDocument) -> str:
    if document.solution.energy.timing == "accelerations":
        limited = any(axis.max_jerk is not None for axis in document.machine.axes)
        jerk = "Jerk: changes of acceleration. " if limited else ""
        return (
            "Stops: speeding up from rest, braking to it, and turning back. Speed: an axis at its highest. "
            "Acceleration: other changes of speed and direction. "
            f"{jerk}Feed: nothing else limits the speed; "
            f"{document.solution.clock.basis}."
        )
    return (
        "Speed: an axis at its highest. Feed: nothing else limits the speed. What stops and corners cost "
        f"isn’t known: the machine states no max_acceleration of {', '.join(document.accelerations_unknown)}."
    )


def _compared(document: ReportDocument) -> str:
    found, measures = "<p>There is no baseline to compare with.</p>", ""
    if document.solution.baselines:
        found, measures = scroll(tables.baseline_table(document)), f"\n{_measures(document)}"
    return f"{found}\n{_missing(document)}{measures}{program_section(document)}"


def _missing(document: ReportDocument) -> str:
    items = tables.missing_list(document)
    return f'<ul class="small">\n{items}\n</ul>' if items else ""


def _measures(document: ReportDocument) -> str:
    base = document.machine.base_power
    with_base = (
        "The machine’s base power isn’t known, so totals with base power can’t be computed; a posture that "
        "takes longer may cost more than it saves."
        if base is None
        else f"With base power: plus {number(base)} W over the cycle time."
    )
    error = document.solution.energy.travel_error
    difference = (
        ""
        if error is None
        else "For the optimised program the metric is off the energy by "
        f"{number(100.0 * error, 1, signed=True)}{THIN_SPACE}%. "
    )
    return (
        '<p class="small">Energy: ∫P dt of the feed drives over the duration of each block; a drive draws '
        "its whole constant power between its slowest and its fastest measured speed, and outside of them in "
        "proportion to speed. Travel metric: every axis is charged for its travel at the programmed feed "
        "(Σ W|Δq|). Neither includes spindle, coolant or cutting power. "
        f"{difference}{with_base}{_left(document)}</p>"
    )


def _left(document: ReportDocument) -> str:
    """Say how much any posture could still save; empty without a lower bound."""
    bound, words = document.solution.bound, document.solution.left
    if bound is None or words is None:
        return ""
    return f" {words[0].upper()}{words[1:]} (certified lower bound: {number(bound.total)} J)."


def _budget(budget: Budget | None) -> str:
    if budget is None:
        return ""
    text = f"Together {number(budget.total)} J ({budget.kwh:.4f} kWh) in {budget.time:.1f} s"
    text += "" if budget.complete else ", without the consumers that aren’t known"
    if budget.cost is not None:
        text += f"; {budget.cost:.4f} {budget.factors.currency}"
    if budget.co2 is not None:
        text += f"; {1000.0 * budget.co2:.1f} g CO₂"
    heading = "<h2>Electricity of the whole job</h2>"
    table = f"{heading}\n{scroll(tables.budget_table(budget))}\n<p>{escape(text)}.</p>"
    return f"<section>\n{table}\n{_cut(budget.cut)}</section>"


def _cut(course: CutCourse | None) -> str:
    if course is None:
        return ""
    words = (
        f"What the program removes of the stock, {number(course.volume.sum())} mm³ together, by cutting it "
        f"along the blocks; means over {STEP:g} s."
    )
    return f"<figure>\n{cut_lines(course)}\n<figcaption>{words}</figcaption>\n</figure>\n"


def _posture(solution: Optimum, admits: Admits | None) -> dict[str, str]:
    valley, surface = path_valley(solution, admits=admits), location_surface(solution)
    first, second = solution.machine.rotaries
    n = len(solution.toolpath)
    hatched = (
        f"Hatched: only collisions of the tool or its holder rule out every {second}, by a map of directions "
        "with a grid of some degrees."
    )
    return {
        "valley": draw_valley(valley),
        "surface": draw_location(surface, {"S_W": surface.power.total}),
        "first": first,
        "second": second,
        "grid": f"{FIRST_STEP:g}° × {SECOND_STEP:g}°",
        "feed": f"{feed_mm_min(solution):.0f}",
        "sampled": f" {MOST_LOCATIONS} of {number(n)} locations are sampled." if n > MOST_LOCATIONS else "",
        "collisions": "Collisions aren’t in this map." if admits is None else hatched,
        "middle": str(surface.location),
        "stays": what_stays(solution.toolpath.tool),
    }


def _findings(document: ReportDocument) -> str:
    summary = document.summary
    if not summary:
        return "<p>No findings.</p>"
    total = number(sum(cause.count for cause in summary))
    listed = number(len(document.findings))
    head = f"{total} findings, one row for each cause; the JSON report lists {listed} places."
    return f"<p>{escape(head)}</p>\n{scroll(tables.causes_table(summary))}"


def _checked(document: ReportDocument) -> str:
    report = document.verdict
    items = "\n".join(f"<li>{escape(sentence)}</li>" for sentence in report.passed)
    listed = f'<ul class="small">\n{items}\n</ul>\n' if items else "<p>Nothing was checked.</p>\n"
    return f"{listed}{scroll(tables.measured_table(report.figures))}"


def _solver(document: ReportDocument) -> str:
    solution = document.solution
    residuals = solution.residuals()
    audit = (
        f"Residuals of the optimised program: tilt overrun {math.degrees(residuals['tilt']):.2g}°, limit "
        f"overrun {residuals['limit']:.2g} mm or rad, contact error {residuals['contact']:.2g} mm."
    )
    kkt = solution.kkt
    if kkt is not None:
        audit += (
            f" Residuals of the optimality conditions: {kkt.dual:.2g} J/rad, bounds violated by "
            f"{kkt.primal:.2g}, complementarity {kkt.complementarity:.2g} J."
        )
    return f'{scroll(tables.solver_table(solution.stages))}\n<p class="small">{escape(audit)}</p>'


def _machine(machine: Machine) -> str:
    figures = machine.provenance
    assumed = sum(f.assumed for f in figures)
    text = f"{machine.description or machine.name}. "
    text += (
        f"{assumed} of {len(figures)} figures are assumed, not measured or printed; the results rest on them."
        if assumed
        else "No figure is assumed."
    )
    if machine.tool_length:
        text += f" The tool is {machine.tool_length:g} mm long from the spindle's gauge point to its tip."
    setup = machine.setup
    if any((*setup.offset, *setup.rotation_deg)):
        text += (
            f" The workpiece's zero is at ({plain_list(setup.offset)}) mm in the machine frame, "
            f"turned by ({plain_list(setup.rotation_deg)}) deg about the machine's X, Y, Z."
        )
    return f"<p>{escape(text)}</p>\n{scroll(tables.machine_table(figures))}"


def finished_section(cut: CutStock | None) -> str:
    """Write the section of the finished part, as HTML; empty if no stock was cut."""
    if cut is None:
        return ""
    found, tolerance = cut.deviations, cut.blank.tolerance
    shares = (
        ("finished", found.share(-tolerance, tolerance)),
        ("higher, up to 2 mm", found.share(tolerance, np.inf)),
        ("lower", found.share(-np.inf, -tolerance)),
    )
    listed = ", ".join(f"{number(100.0 * share, 1)} % {name}" for name, share in shares)
    text = (
        f"The stock, cut along the program at rays {number(found.resolution, 2)} mm apart. Of the part’s "
        f"area {listed} (±{number(tolerance, 2)} mm). Left beyond the part: {number(found.left_volume, 1)} "
        f"mm³; lacking of it: {number(found.gouged_volume, 2)} mm³, at most {number(found.deepest, 3)} mm "
        f"deep. At a ray distances are exact to {number(found.uncertainty, 3)} mm; between rays crests read "
        "lower, and ribs thinner than their distance may be missed."
    )
    pictures = "\n".join(_figure(found, tolerance, name, np.array(view)) for name, view in VIEWS.items())
    legend = (
        f"Green: finished. Red: cut into, dark from {DEEP * tolerance:g} mm. Blue: left, dark from "
        f"{HIGH * tolerance:g} mm. Grey: no block has cut there."
    )
    return (
        f'<section>\n<h2>The finished part</h2>\n<p>{text}</p>\n<div class="views">\n{pictures}\n</div>\n'
        f'<p class="small">{legend}</p>\n</section>'
    )


def _figure(found: Deviations, tolerance: float, name: str, view: Array) -> str:
    address = png_address(part_map(found, tolerance, view))
    image = f'<img alt="The finished part {name}" src="{address}">'
    return f"<figure>{image}<figcaption>{name}</figcaption></figure>"


def part_map(found: Deviations, tolerance: float, view: Array) -> NDArray[np.uint8]:
    """Draw the finished stock's points near the part from a direction, (h, w, 3); white where none is."""
    back = view / np.linalg.norm(view, axis=-1)
    up = np.array([0.0, 1.0, 0.0]) if abs(back[2]) > 0.99 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right, axis=-1)
    up = np.cross(back, right)
    seen = np.flatnonzero(product(found.normal, back) > 0.05)
    points = found.surface.points[seen]
    if not len(points):
        return np.full((1, 1, 3), 255, np.uint8)
    across, high = product(points, right), product(points, up)
    size = max(float(np.ptp(across)), float(np.ptp(high)), 1e-9)
    # Rays are at most √3 of their distance apart on a surface, seen from any side.
    pixel = max(size / PIXELS, found.resolution)
    column = ((across - across.min()) / pixel).astype(int) + 1
    row = ((high.max() - high) / pixel).astype(int) + 1
    picture = np.full((row.max() + 2, column.max() + 2, 3), 255, np.uint8)
    # What is nearer is drawn later, over what is behind it.
    order = np.argsort(product(points, back), kind="stable")
    colours = colours_of(found, tolerance)[seen]
    for down in (0, 1):
        for aside in (0, 1):
            picture[row[order] + down, column[order] + aside] = colours[order]
    picture[row[order], column[order]] = colours[order]
    return picture
