"""The commands about toolpaths: plan, optimise, preview."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import groupby
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.text import Text

from fiveaxis.base import (
    Bounds,
    Framing,
    Infeasible,
    JobError,
    OnMachine,
    Placing,
    ReadProgram,
    SettingError,
    Writing,
    group_findings,
    has_errors,
    require_suffix,
)
from fiveaxis.cli.options import (
    LEANING,
    NC,
    NOT_GIVEN,
    PLANNING,
    POSTURE,
    READING,
    SHOWN,
    WRITING,
    AsJson,
    Input,
    is_verbose,
    read_flags,
    takes,
)
from fiveaxis.cli.terminal import (
    WIDTH,
    err,
    errors_explained,
    out,
    parse_words,
    print_budget,
    print_causes,
    print_filled,
    print_first_run,
    print_json,
    print_release,
    print_table,
    print_written,
)
from fiveaxis.cli.work import Work, shown_work

# Verdict -> the colour of the first answer.
COLOURS = {"safe": "green", "partial": "yellow", "unknown": "yellow", "unsafe": "red", "overridden": "red"}
# Details with lines of their own.
ONE_BY_ONE = ("Risk", "Correct", "Not asked for")
KINDS = {"cut": "cuts", "link": "links", "rapid": "rapid"}

if TYPE_CHECKING:
    from fiveaxis.cam import PlanReport
    from fiveaxis.job import Job, Outcome, Part, RevisedProgram
    from fiveaxis.model import Energy, Toolpath
    from fiveaxis.posture import Optimum
    from fiveaxis.show import Answer, FrontPrograms, Preview, ReportDocument, SetupSearched


@takes(PLANNING, LEANING)
def plan(
    context: typer.Context,
    source: Input,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="list of points (.csv)")] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Plan finishing passes on a mesh, and measure their ridges and chord error."""
    with errors_explained(as_json) as written:
        with shown_work(err, hidden=as_json) as work:
            from fiveaxis.cam import size_text
            from fiveaxis.job import is_mesh, measure_plan, plan_mesh
            from fiveaxis.nc import write_toolpath

            if output is not None:
                require_suffix(output, [".csv"], "a list of points")
            job = job_of(context.params)
            if not is_mesh(job.input):
                raise SettingError(
                    "passes are planned on a part (.stl .ply .obj .off .step .iges)", file=job.input
                )

            plan = work.run(partial(plan_mesh, job))
            toolpath = plan.toolpath
            work.step("measuring ridges and chords", 0, 1)
            quality = work.run(lambda _: measure_plan(job, toolpath))
            if output is not None:
                work.step("writing the path", 0, 1)
                written.append(write_toolpath(toolpath, output))
        document = _plan_document(toolpath, len(plan.first), quality)
        causes = group_findings(toolpath.findings)
        if as_json:
            size = [round(float(extent), 6) for extent in quality.part_size]
            summary = [cause.as_dict() for cause in causes]
            findings = [finding.as_dict() for finding in toolpath.findings]
            print_json({"part_size_mm": size} | document | {"summary": summary, "findings": findings})
        else:
            out.print(f"part {size_text(quality.part_size)}", highlight=False)
            for name, value in document.items():
                out.print(f"{name}: {'not known before the postures' if value is None else value}")
        print_causes(causes, err)
        for path in written:
            print_written(path, *_plan_facts(document))
        if has_errors(toolpath.findings):
            raise typer.Exit(Infeasible.exit_code)


@takes(POSTURE, PLANNING, READING, WRITING)
def optimise(
    context: typer.Context,
    source: Input,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="folder for the results")] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Optimise the tool posture of every cutter location; write verified NC, motion, report and preview."""
    with errors_explained(as_json) as written:
        with job_work(hidden=as_json) as work:
            from fiveaxis.base import require_folder, resumable
            from fiveaxis.job import (
                digest_job,
                resolve,
                run_task,
                takes_operations,
                withdrawing,
                write_outcome,
            )

            if output is not None:
                require_folder(output)
            job = job_of(context.params)
            with withdrawing(output):
                if takes_operations(job):
                    return _revise(job, output, work, written, as_json=as_json)
                task = work.run(partial(resolve, job))
                # Only now: what is hashed is what was read.
                digest = "" if output is None else digest_job(job)
                with resumable(digest, output) as checkpoint:
                    outcome = work.run(partial(run_task, task, checkpoint=checkpoint))
                    if output is not None:
                        written += write_outcome(outcome, output, work.step)
        if output is not None:
            print_written(output, *(str(path.relative_to(output)) for path in written))
        if as_json:
            print_json(outcome.document)
        else:
            _print_outcome(outcome)
        print_causes(group_findings(outcome.solution.toolpath.findings), err)
        print_causes(group_findings(outcome.program.findings), err)
        print_release(outcome.gate)
        if outcome.gate.kept:
            raise typer.Exit(1)


def _revise(job: Job, output: Path | None, work: Work, written: list[Path], *, as_json: bool) -> None:
    from fiveaxis.job import revise_operations, write_revised

    made = work.run(partial(revise_operations, job))
    if output is not None and made.outcomes:
        written += write_revised(made, output, work.step)
        print_written(output, *(str(path.relative_to(output)) for path in written))
    if as_json:
        print_json(made.as_dict())
    else:
        _print_operations(made)
    for number, outcome in made.outcomes.items():
        answers = outcome.report.answers
        if not as_json:
            out.print(f"operation {number}", style="bold")
            _print_answer(answers.safe, COLOURS[answers.verdict])
            _print_answer(answers.saved)
        print_causes(group_findings(outcome.solution.toolpath.findings), err)
        print_release(outcome.gate)
    if not made.ok:
        raise typer.Exit(1)


@takes(SHOWN)
def preview(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(help="NC program, shown as it is; or a job .toml, which is run")],
    browser: Annotated[bool, typer.Option(help="open the page in a browser")] = True,
    **_: Any,
) -> None:
    """Show a program as it is, or the result of a job, in a browser here until Ctrl-C."""
    with errors_explained(False):
        with job_work() as work:
            showing = _result if source.suffix.lower() == ".toml" else _as_it_is
            viewer = showing(context.params, work, browser=browser)
        with viewer:
            out.print(f"preview at {viewer.url()} until Ctrl-C")
            viewer.wait()


def _result(options: Mapping[str, Any], work: Work, *, browser: bool) -> Preview:
    from fiveaxis.job import run_job
    from fiveaxis.show import preview as show

    outcome = work.run(partial(run_job, job_of(options)))
    work.step("making the scene", 0, 1)
    return show(
        outcome.solution,
        program=outcome.program,
        surroundings=outcome.solution.surroundings,
        findings=outcome.verdict.findings,
        open_browser=browser,
    )


def _as_it_is(options: Mapping[str, Any], work: Work, *, browser: bool) -> Preview:
    from fiveaxis.cli.verify_verb import reading_of
    from fiveaxis.job import load_job_machine, load_surroundings, require_input
    from fiveaxis.show import Showing, show_operations
    from fiveaxis.show import preview as show

    job = job_of(options)
    require_input(job.input)
    given = Showing.of(reading_of(options), job.surrounding, tool=job.tool, progress=work.step)
    machine, around = load_job_machine(job, shown=True), load_surroundings(job)
    whole = work.run(lambda _: show_operations(job.input, machine, given, around))
    for sentence in whole.assumed:
        err.print(f"assumed: {sentence}", markup=False, soft_wrap=True)
    work.step("making the scene", 0, 1)
    return show(whole, open_browser=browser)


def job_of(options: Mapping[str, Any]) -> Job:
    """Make the job of a command's options, which replace settings of a job file."""
    from fiveaxis.job import Job, PlanTable, make_job, read_fixtures, read_job

    given = {name: value for name, value in options.items() if value not in NOT_GIVEN}
    settings = {name: value for name, value in given.items() if name in Job.model_fields}
    settings["setup"] = read_flags(Placing, options)
    settings["plan"] = {name: value for name, value in options.items() if name in PlanTable.model_fields}
    written_for = {"machine": options.get("written_for")}
    settings["program"] = written_for | read_flags(ReadProgram, options)
    settings["nc"] = read_flags(Framing, options, NC)
    for name in {"columns", "allow"} & settings.keys():
        settings[name] = parse_words(settings[name])
    settings |= read_flags(OnMachine, options) | read_flags(Bounds, options) | read_flags(Writing, options)
    if options.get("fixtures") is not None:
        settings |= read_fixtures(options["fixtures"])
    source = options["source"]
    if source.suffix.lower() == ".toml":
        job = read_job(source, **settings)
    else:
        job = make_job(input=source, **settings)
    searched = options.get("setup_search")
    return job if searched is None else choose_search(job, searched)


def choose_search(job: Job, text: str) -> Job:
    """Set the search for the setup as ``--setup`` says: ``x=-50:50,angle=0:90`` (mm, deg), ``x`` or ``auto``.

    `JobError` for another form, an unknown name, a name whose range the job doesn't give.
    """
    from fiveaxis.job import SEARCHED, make_job

    search = job.setup.search
    if text.strip() == "auto":
        return make_job(job, setup={"search": {"auto": True}})
    known = {} if search is None else search.ranges
    chosen: dict[str, Any] = {}
    for part in text.split(","):
        name, given, ends = (piece.strip() for piece in part.partition("="))
        if name not in SEARCHED:
            raise JobError(f"--setup: {name!r} is unknown; known: {', '.join(SEARCHED)}")
        if not given and name not in known:
            raise JobError(f"--setup: {name} has no range; give {name}=LOW:HIGH, or setup.search in the job")
        try:
            low, high = (float(end) for end in ends.split(":")) if given else known[name]
        except ValueError:
            raise JobError(f"--setup: {part.strip()!r} isn't of the form {name}=LOW:HIGH") from None
        chosen[name] = (low, high)
    return make_job(job, setup={"search": chosen if search is None else {"tries": search.tries} | chosen})


@contextmanager
def job_work(*, hidden: bool = False) -> Iterator[Work]:
    """Show the work on a job, imports included, and say at its end how long it took.

    That loops are compiled is said once the input is read: wrong input is told without.
    """
    with shown_work(err, hidden=hidden) as work:
        from fiveaxis.posture import advance

        work.when_read = partial(print_first_run, advance)
        yield work
    err.print(f"done in {work.elapsed:.1f} s")


def _plan_document(toolpath: Toolpath, passes: int, quality: PlanReport) -> dict[str, Any]:
    cuts = int(toolpath.cutting.sum())
    return {
        "locations": len(toolpath),
        "cutting": cuts,
        "links": len(toolpath) - cuts,
        "passes": passes,
        "length_mm": round(float(toolpath.lengths.sum()), 3),
        "cut_length_mm": round(quality.cut_length, 3),
        "link_length_mm": round(quality.link_length, 3),
        "scallop_largest_mm": _known(quality.scallop_largest),
        "scallop_mean_mm": _known(quality.scallop_mean),
        "chord_error_mm": round(quality.chord_largest, 6),
        "ridges_measured": quality.ridges,
        "left_out": dict(toolpath.ignored),
    }


def _known(value: float) -> float | None:
    """Round a figure; None where it isn't known, as ridges of a cutter that may lean in many ways."""
    return None if math.isnan(value) else round(value, 6)


def _plan_facts(document: Mapping[str, Any]) -> list[str]:
    left = " and ".join(f"{count} {what}" for what, count in document["left_out"].items() if count)
    counts = [f"{document[what]} {what}" for what in ("locations", "passes")]
    return [*counts, f"{document['length_mm']} mm", f"left out {left or 'nothing'}"]


def _print_outcome(outcome: Outcome) -> None:
    """Print the three answers and the programs compared, at a glance; with -v everything else."""
    answers = outcome.report.answers
    _print_answer(answers.safe, COLOURS[answers.verdict])
    _print_answer(answers.saved)
    if outcome.report.baseline is not None:
        _print_compared(outcome.report)
    _print_answer(answers.next)
    if outcome.setup_search is not None:
        _print_setup(outcome.setup_search)
    if outcome.front is not None:
        _print_front(outcome.front)
    if is_verbose():
        _print_details(outcome)


def _print_operations(made: RevisedProgram) -> None:
    """Print what became of each operation: time, starts and reversals, energy of its lines before and now."""
    rows: list[tuple[str, ...]] = []
    for part in made.parts:
        at = part.operation
        what = part.verdict if part.verdict != "stays" else f"stays: {part.why}"
        lines = f"{at.first_line}-{at.last_line}"
        rows.append((str(at.number), lines, at.kind, at.tool, *_before_and_now([part]), what))
    if len(made.parts) > 1:
        rows.append(("", "", "all", "", *_before_and_now(made.parts), made.verdict))
    print_table(("", "lines", "kind", "tool", "s", "now", "events", "now", "J", "now", ""), rows)
    out.print("events: starts and reversals of axes; all of whole operations, approach and retract included")
    if any(part.before is None for part in made.parts):
        out.print("?: the lines don't say it, as of rapid moves of unknown speed (--rapid) or place (--zero)")
    for part in made.parts:
        if part.better is not None:
            out.print(f"operation {part.operation.number}: {part.why}", markup=False, soft_wrap=True)


def _before_and_now(parts: Sequence[Part]) -> Iterator[str]:
    """Write time, events and energy of operations, before and now; ``?`` where one of them isn't known."""
    pair = [[part.before for part in parts], [part.after for part in parts]]
    columns: list[tuple[Callable[[Energy], float], str]] = [
        (lambda e: e.time, ".1f"),
        (lambda e: e.starts + e.reversals, ".0f"),
        (lambda e: e.total, ".0f"),
    ]
    for value, form in columns:
        for each in pair:
            known = [value(energy) for energy in each if energy is not None]
            yield f"{sum(known):{form}}" if len(known) == len(each) else "?"


def _print_details(outcome: Outcome) -> None:
    from fiveaxis.cam import size_text

    solution, program = outcome.solution, outcome.program
    print_causes(outcome.gate.report.summary(), out)
    if outcome.part_size is not None:
        out.print(f"part {size_text(outcome.part_size)}", highlight=False)
    if outcome.scallop is not None:
        wanted, largest = outcome.scallop
        out.print(f"ridges between passes up to {largest:.4g} mm, asked {wanted:g} mm", highlight=False)
    _print_energies(solution)
    made = outcome.report.program
    if made is not None:
        kept = made.redundant_kept_for
        held = f"; none removed because of {', '.join(kept)}" if kept else ""
        out.print(
            f"program: {made.blocks} blocks for {made.blocks_before} locations: {made.inserted} inserted so "
            "that the tool stays on its path and axes at rest stay at rest, and "
            f"{made.removed} redundant ones removed{held}",
            soft_wrap=True,
        )
    time = program.run_time
    why = "as programmed" if time.missing else "with the machine's accelerations"
    why += f"; {time.assumed}" if time.assumed else ""
    out.print(f"program time: {time.total:.1f} s, {why}", soft_wrap=True, markup=False)
    if program.energy is not None:
        spent = f"program energy: {program.energy.total:.0f} J of its words, approach and retract included"
        out.print(f"{spent}, as `fiveaxis energy` gives it", soft_wrap=True, markup=False)
    print_budget(outcome.budget)
    for name, baseline in solution.compared.items():
        if baseline.note:
            out.print(f"baseline {name}: {escape(baseline.note)}", soft_wrap=True)
    for name, reason in solution.missing.items():
        out.print(f"no baseline {name}: {escape(reason)}")
    if solution.left is not None:
        out.print(solution.left)


def _print_answer(answer: Answer, colour: str = "") -> None:
    said = Text(fill(f"{answer.question} {answer.text}", WIDTH, subsequent_indent="  "), colour)
    said.stylize("bold", 0, len(answer.question))
    out.print(said, soft_wrap=True, highlight=False)
    shown = (*answer.details, *(answer.folded if is_verbose() else ()))
    for about, details in groupby(shown, key=lambda detail: detail.about):
        texts = [detail.text for detail in details]
        if about not in ONE_BY_ONE:
            texts = [" ".join(text[0].upper() + text[1:] for text in texts)]
        for text in texts:
            print_filled(f"{about}: {text}")


def _print_compared(document: ReportDocument) -> None:
    rows = []
    for name, energy in document.solution.energies.items():
        share = document.saved(name, document.measure) if name in document.solution.baselines else None
        saved = "" if share is None else f"{100.0 * share:.1f} %"
        joules = f"{getattr(energy, document.measure):.0f}"
        rows.append((name, joules, saved, f"{energy.time:.1f}", str(energy.starts), str(energy.reversals)))
    print_table(("program", "J", "saved", "s", "starts", "reversals"), rows)


def _print_front(front: FrontPrograms) -> None:
    from fiveaxis.posture import RESULT

    based = front.with_base
    slower = any(each.point.slowest < 1.0 for each in front.points)
    heads = ["number", "J", *["with base J"] * based, "program s", "bends rad²", "deg/mm"]
    heads += [*["least feed"] * slower, "program", ""]
    rows = [
        (
            str(each.number),
            f"{each.point.energy.total:.1f}",
            *["" if each.point.energy.with_base is None else f"{each.point.energy.with_base:.1f}"] * based,
            f"{each.point.energy.time:.1f}",
            f"{each.point.bend:.4f}",
            f"{math.degrees(each.point.steepest):.2f}",
            *[f"{each.point.slowest:.2f}"] * slower,
            "released" if each.released else "kept back",
            RESULT if each.number == front.picked else "",
        )
        for each in front.points
    ]
    out.print("solutions of the front (--pick delivers another one)")
    print_table(heads, rows)


def _print_energies(solution: Optimum) -> None:
    from fiveaxis.model import DRAWN

    energies, savings = solution.energies, solution.savings()
    ranges = solution.savings_ranges()
    kinds = [k for k in KINDS if any(k in energy.by_kind for energy in energies.values())]
    kinds = [] if kinds == ["cut"] else kinds
    heads = (head for kind in kinds for head in (f"{KINDS[kind]} J", "s"))
    axes = (f"{c} J" for c in solution.machine.letters)
    rows = []
    for name, energy in energies.items():
        saved = f"{100.0 * savings[name]:.1f} %" if name in savings else ""
        if name in ranges:
            low, high = ranges[name]
            saved += f" ({100.0 * low:.0f}…{100.0 * high:.0f})"
        joules = (f"{joule:.0f}" for joule in energy.by_axis.values())
        shares = [energy.by_kind.get(kind) for kind in kinds]
        apart = [
            text
            for share in shares
            for text in (("", "") if share is None else (f"{share.total:.0f}", f"{share.time:.1f}"))
        ]
        own = (f"{energy.total:.0f}", saved, *joules, f"{energy.time:.1f}", f"{energy.travel:.0f}")
        rows.append((name, *own, *apart))
    out.print("energy of whole programs; feed drives only, no base load")
    print_table(("program", "J", "saved", *axes, "s", "travel J", *heads), rows)
    if ranges:
        out.print(
            f"saved (least…most): on {DRAWN} machines drawn from the bands of the estimated powers",
            soft_wrap=True,
        )
    _print_times(solution)
    if solution.energy.band is not None:
        out.print(solution.energy.band, soft_wrap=True)


def _print_times(solution: Optimum) -> None:
    if solution.energy.timing == "programmed":
        return
    rows, savings = [], solution.time_savings()
    for name, energy in solution.energies.items():
        saved = f"{100.0 * savings[name]:.2f} %" if name in savings else ""
        rows.append((name, f"{energy.time:.2f}", saved, f"{energy.feed_time:.2f}"))
    out.print(f"time of the same blocks, {solution.clock.basis}", markup=False)
    print_table(("program", "s", "saved", "at the feed s"), rows)


def _print_setup(found: SetupSearched) -> None:
    chosen, given = found.chosen, found.given
    values = f"offset {list(chosen.offset)} mm, rotation {list(chosen.rotation_deg)} deg"
    if chosen == given:
        least = f"{100.0 * found.least_saving:.2f} %"
        return out.print(
            f"setup: {values}, as given; no other one was found that saves more than {least}", markup=False
        )
    saved = "can't be followed" if found.saved is None else f"costs {given.energy:.0f} J"
    share = "" if found.saved is None else f", {100.0 * found.saved:.1f} % saved"
    out.print(f"set the part up at {values}: the given setup {saved}{share}", markup=False, soft_wrap=True)
