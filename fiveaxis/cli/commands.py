"""The commands of the command line."""

import typer

from fiveaxis.cli.batch_verb import batch
from fiveaxis.cli.calibration_verb import calibrate
from fiveaxis.cli.energy_verb import energy
from fiveaxis.cli.job_verb import job
from fiveaxis.cli.machine_verbs import check, import_machine, info, machines, urdf
from fiveaxis.cli.new_machine_verb import machine, new
from fiveaxis.cli.path_verbs import optimise, plan, preview
from fiveaxis.cli.post_verb import controls, post
from fiveaxis.cli.surface_verb import surface
from fiveaxis.cli.verbosity import with_options
from fiveaxis.cli.verify_verb import verify

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Choose the tool posture of a 5-axis path that costs the machine the least energy.",
)
app.command()(with_options(machines))
app.command()(with_options(info))
app.command()(with_options(check))
app.command("import")(with_options(import_machine))
app.command()(with_options(urdf))
machine.command()(with_options(new))
app.add_typer(machine, name="machine")
app.command()(with_options(energy))
app.command()(with_options(plan))
app.command()(with_options(optimise))
app.command()(with_options(verify))
app.command()(with_options(post))
app.command()(with_options(controls))
# A tip like -10,0,5 looks like an option; unknown options are taken as arguments.
app.command(context_settings={"ignore_unknown_options": True})(with_options(surface))
app.command()(with_options(preview))
app.command()(with_options(calibrate))
app.command()(with_options(batch))
app.command()(with_options(job))
