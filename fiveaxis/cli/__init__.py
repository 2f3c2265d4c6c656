"""The command line: each verb is one library call with the same option names.

What a verb answers goes to stdout, everything else (progress, warnings, errors) to stderr. Exit codes: 0
fine, 1 verification or a check found an error, 2 wrong input or usage, 3 no feasible posture; of a batch that
of its worst job.
"""

import typer

from fiveaxis.cli.batch_verb import batch
from fiveaxis.cli.calibration_verb import calibrate
from fiveaxis.cli.energy_verb import energy
from fiveaxis.cli.job_verb import job
from fiveaxis.cli.machine_verbs import check, import_machine, info, machines, urdf
from fiveaxis.cli.path_verbs import optimise, plan, preview
from fiveaxis.cli.post_verb import controls, post
from fiveaxis.cli.surface_verb import surface
from fiveaxis.cli.verify_verb import verify

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Choose the tool posture of a 5-axis path that costs the machine the least energy.",
)
app.command()(machines)
app.command()(info)
app.command()(check)
app.command("import")(import_machine)
app.command()(urdf)
app.command()(energy)
app.command()(plan)
app.command()(optimise)
app.command()(verify)
app.command()(post)
app.command()(controls)
# Unknown options pass as arguments, since a tip like -10,0,5 looks like one.
app.command(context_settings={"ignore_unknown_options": True})(surface)
app.command()(preview)
app.command()(calibrate)
app.command()(batch)
app.command()(job)


def main() -> None:
    """Run the command line."""
    app()
