"""The page: first the three answers, then the findings, then the evidence."""

from __future__ import annotations

import logging
import math
from base64 import b64encode
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

from fiveaxis.energy import Budget
from fiveaxis.files import write_atomically
from fiveaxis.machine import Machine
from fiveaxis.posture import Solution
from fiveaxis.report import tables
from fiveaxis.report.document import ReportDocument
from fiveaxis.report.figures import axis_lines, energy_bars, power_lines, speed_lines, spending_lines
from fiveaxis.report.landscape import FIRST_STEP, MOST_LOCATIONS, SECOND_STEP, Admits, feed_mm_min
from fiveaxis.report.maps import draw_location, draw_valley
from fiveaxis.report.sections import answers_section, front_section, program_section, setup_section
from fiveaxis.report.surfaces import LocationSurface, location_surface, path_valley
from fiveaxis.report.tables import scroll
from fiveaxis.report.words import THIN_SPACE, number, plain, plain_list, what_stays

logger = logging.getLogger(__name__)

# The browser applies only the page's own style, runs only its own script, and fetches nothing.
POLICY = (
    "default-src 'none'; style-src {style}; script-src {script}; img-src data:; base-uri 'none'; "
    "form-action 'none'"
)


def write_report(document: ReportDocument, path: str | Path, *, admits: Admits | None = None) -> Path:
    """Write a run's page: one file without network access, the same bytes for the same inputs.

    Parameters
    ----------
    document : the facts of the run
    path : the ``.html`` file
    admits : checks, for locations (m,) and rotary angles (m, 2), rad, which postures are clear of collisions

    Raises
    ------
    SettingError
        The file can't be written there.
    """
    page = compose_page(document, admits)
    logger.info("%s: %d kB about %d locations", Path(path).name, len(page) // 1000, document.locations)
    return write_atomically(path, page)


def compose_page(document: ReportDocument, admits: Admits | None = None) -> str:
    """Compose the page as HTML text."""
    room = files("fiveaxis.report")
    template = Template(room.joinpath("page.html").read_text(encoding="utf-8"))
    style, script = (room.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    body = template.substitute(
        heading=escape(document.name),
        facts=_facts(document),
        answers=answers_section(document),
        compared=_compared(document),
        setup=setup_section(document.setup_search) + front_section(document.front),
        energy=_energy(document),
        budget=_budget(document.budget),
        motion=_motion(document),
        posture=_posture(document, admits),
        findings=_findings(document),
        checked=_checked(document),
        solver=_solver(document),
        machine=_machine(document.machine),
        inputs=scroll(tables.input_table(document.inputs)),
    )
    return page_of(document.name, style, script, body)


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


def _facts(document: ReportDocument) -> str:
    machine, solution = document.machine, document.solution
    low, high = map(plain, document.tilt)
    return escape(
        f"{number(document.locations)} locations · {document.tool} · "
        f"machine {machine.name} (code {machine.code}, axes {' '.join(machine.letters)}) · "
        f"tool axis {low}…{high}° from the {solution.tilt.name}"
    )


def _compared(document: ReportDocument) -> str:
    if not document.solution.baselines:
        return (
            f"<p>There is no baseline to compare with.</p>\n{_missing(document)}{program_section(document)}"
        )
    return (
        f"{scroll(tables.baseline_table(document))}\n{_missing(document)}\n{_measures(document)}"
        f"{program_section(document)}"
    )


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
        '<p class="small">Energy: ∫P dt of the feed drives over the duration of each block; a drive with '
        "constant power pays for the whole block, however short its own travel. The lower energy applies if "
        "a drive’s power falls in proportion to its speed below the slowest measured speed. Travel metric: "
        "every axis is charged for its travel at the programmed feed (Σ W|Δq|). None of them includes "
        f"spindle, coolant or cutting power. {difference}{with_base}{_left(document)}</p>"
    )


def _left(document: ReportDocument) -> str:
    """Say how much any posture could still save; empty without a lower bound."""
    bound, words = document.solution.bound, document.solution.left
    if bound is None or words is None:
        return ""
    return f" {words[0].upper()}{words[1:]} (certified lower bound: {number(bound.total)} J)."


def _energy(document: ReportDocument) -> str:
    solution, baseline = document.solution, document.baseline
    compared = "the optimised program"
    if baseline is not None:
        compared = f"“{escape(baseline)}” and of {compared}"
    return (
        _figure(energy_bars(solution, baseline), f"Energy of {compared} by axis; feed drives only.")
        + scroll(tables.axis_table(document))
        + _figure(
            spending_lines(solution, baseline), "The same energy, added up along the path; feed drives only."
        )
    )


def _budget(budget: Budget | None) -> str:
    """Write the electricity of the whole job; empty if it wasn't computed."""
    if budget is None:
        return ""
    text = f"Together {number(budget.total)} J ({budget.kwh:.4f} kWh) in {budget.time:.1f} s"
    text += "" if budget.complete else ", without the consumers that aren’t known"
    if budget.cost is not None:
        text += f"; {budget.cost:.4f} {budget.factors.currency}"
    if budget.co2 is not None:
        text += f"; {1000.0 * budget.co2:.1f} g CO₂"
    heading = "<h2>Electricity of the whole job</h2>"
    return f"<section>\n{heading}\n{scroll(tables.budget_table(budget))}\n<p>{escape(text)}.</p>\n</section>"


def _motion(document: ReportDocument) -> str:
    solution, baseline = document.solution, document.baseline
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
        scroll(tables.steadiness_table(document))
        + f'<p class="small">{escape(events)}</p>\n'
        + _figure(axis_lines(solution, baseline), escape(caption))
        + _figure(speed_lines(solution, baseline), escape(speeds))
        + _figure(power_lines(solution, baseline), escape(powers))
    )


def _posture(document: ReportDocument, admits: Admits | None) -> str:
    solution = document.solution
    valley, surface = path_valley(solution, admits=admits), location_surface(solution)
    return _figure(draw_valley(valley), escape(_map_caption(solution, admits is not None))) + _figure(
        draw_location(surface, {"S_W": surface.power.total}), escape(_surface_caption(solution, surface))
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
    sampled = "" if n <= MOST_LOCATIONS else f" {MOST_LOCATIONS} of {number(n)} locations are sampled."
    return (
        f"Colour: energy of a move from axis zero to this location with {first} as on the left and the "
        f"cheapest {second} that tilt and axis limits admit (S_W, feed drives only). The chosen "
        f"{second} may be another one: the optimiser minimises the change from location to location, not the "
        f"height, which is drawn below for each program. Grey: no {second} is admissible. {first} is shown "
        "without whole turns; grid "
        f"{FIRST_STEP:g}° × {SECOND_STEP:g}°, median feed {feed_mm_min(solution):.0f} mm/min.{sampled} "
        f"{collisions}"
    )


def _surface_caption(solution: Solution, surface: LocationSurface) -> str:
    first, second = solution.machine.rotaries
    return (
        f"Energy of a move from axis zero to location {surface.location}, the middle of the path, for every "
        f"pair of {first} and {second}. {what_stays(solution.toolpath.tool)} (S_W, feed drives only). A "
        "move costs the change between two postures, not the height. Collisions aren’t in this map."
    )


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


def _figure(content: str, caption: str) -> str:
    return f"<figure>\n{content}\n<figcaption>{caption}</figcaption>\n</figure>\n"
