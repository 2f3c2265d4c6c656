"""The command that computes and draws the power surface."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.base import LeanBounds, OnMachine, Progress, SettingError, columns_text, is_file, require_suffix
from fiveaxis.cli.options import LEANING, NOT_GIVEN, ON_MACHINE, PLANNING, AsJson, optional, read_flags, takes
from fiveaxis.cli.path_verbs import job_work
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import (
    err,
    errors_explained,
    load_powered,
    parse_numbers,
    print_json,
    print_written,
    require_between,
    require_machine,
)
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.show import Drawn

FEED, STEP = 1000.0, 2.0  # mm/min, deg
# Options of a tip; a job has its own settings.
TIP: Mapping[str, Any] = {
    **{name: ON_MACHINE[name] for name in ("machine", "assume", "drives")},
    "feed": PLANNING["feed"],
    "tilt": LEANING["tilt"],
    "normal": optional(str, "X,Y,Z: surface normal, for --tilt"),
}


@takes(TIP)
def surface(
    context: typer.Context,
    source: Annotated[
        str,
        typer.Argument(
            help="X,Y,Z of a tool tip in mm, workpiece frame; or a job .toml", metavar="X,Y,Z|JOB.toml"
        ),
    ],
    location: Annotated[
        int | None,
        typer.Option("--location", help="of the path, from 0: its surface, in place of the path's valley"),
    ] = None,
    step: Annotated[
        float | None, typer.Option("--step", help="step of the rotary angles, deg; default: 2")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="table (.csv) or figure (.svg, .html); default: the table on stdout"
        ),
    ] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Compute the power surface S_W = S_WL + S_WR over the rotary angles, or its valley along a path.

    At a tip the cheapest posture is marked; of a job, which is run first, result and baselines are.
    """
    with errors_explained(as_json) as written:
        from fiveaxis.show import DRAWN_SUFFIXES, STEPS

        if output is not None:
            require_suffix(output, DRAWN_SUFFIXES, "a table or a figure")
        if step is not None:
            require_between("--step", step, *STEPS, "deg")
        options = context.params
        is_tip = "," in source and not is_file(source)
        with shown_work(err, hidden=as_json) if is_tip else job_work(hidden=as_json) as work:
            if is_tip:
                found = work.run(lambda _: _at_tip(source, options))
            else:
                found = work.run(partial(_of_job, Path(source), options))
            if output is not None:
                work.step("writing", 0, 1)
                written.append(found.write(output))
        for path in written:
            print_written(path)
        if as_json:
            print_json(found.as_lists())
        elif output is None:
            write_results(columns_text(found.as_lists()))


def _at_tip(source: str, options: Mapping[str, Any]) -> Drawn:
    from fiveaxis.show import tip_surface

    tip = parse_numbers(source, 3, "X,Y,Z")
    if options["location"] is not None:
        raise SettingError("--location has no effect at a tip; leave it out, or name a job")
    feed, normal = options["feed"], options["normal"]
    require_between("--feed", FEED if feed is None else feed, 1e-3, 1e6, "mm/min")
    assume = read_flags(OnMachine, options).get("assume")
    return tip_surface(
        load_powered(require_machine(options["machine"]), options["drives"], assume),
        tip,
        FEED if feed is None else feed,
        normal=None if normal is None else parse_numbers(normal, 3, "X,Y,Z", flag="--normal"),
        tilt=read_flags(LeanBounds, options).get("tilt"),
        step_deg=options["step"] or STEP,
    )


def _of_job(source: Path, options: Mapping[str, Any], progress: Progress) -> Drawn:
    from fiveaxis.job import clear_postures, read_job, run_job
    from fiveaxis.show import location_surface, path_valley

    given = next((name for name in TIP if options[name] not in NOT_GIVEN), None)
    if given is not None:
        raise SettingError(f"--{given} is for a tip; state it in the job")
    if options["step"] is not None and options["location"] is None:
        raise SettingError("--step is for one location (--location); leave it out for the valley of a path")
    if source.suffix.lower() != ".toml":
        raise SettingError(
            "is no tip (X,Y,Z) and no job (.toml); `fiveaxis job --init` writes one", file=source
        )
    outcome = run_job(read_job(source), progress)
    progress("computing the surface", 0, 1)
    if options["location"] is None:
        return path_valley(outcome.solution, admits=clear_postures(outcome))
    return location_surface(outcome.solution, options["location"], step_deg=options["step"] or STEP)
