"""The commands of the command line."""

from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from fiveaxis.cli.batch_verb import batch, compare
from fiveaxis.cli.calibration_verb import calibrate
from fiveaxis.cli.energy_verb import energy
from fiveaxis.cli.job_verb import job
from fiveaxis.cli.machine_verbs import check, import_machine, info, machines, urdf
from fiveaxis.cli.options import with_options
from fiveaxis.cli.path_verbs import optimise, plan, preview
from fiveaxis.cli.post_verb import controls, post
from fiveaxis.cli.process import write_results
from fiveaxis.cli.surface_verb import surface
from fiveaxis.cli.verify_verb import verify


class MachineCommands(TyperGroup):
    """The commands that describe a machine; their options are the questions about its figures.

    With them the machine's modules are loaded: only if one of the commands is used.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """List the names of the commands."""
        return ["new"]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Make a command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        from fiveaxis.cli.new_machine_verb import new

        alone = typer.Typer(add_completion=False)
        alone.command(cmd_name)(with_options(new))
        return get_command(alone)


app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Choose the tool posture of a 5-axis path that costs the machine the least energy.",
)


def print_version(asked: bool) -> None:
    """Print the version and stop, if it is asked for."""
    if asked:
        from fiveaxis import __version__

        write_results(f"fiveaxis {__version__}\n")
        raise typer.Exit


@app.callback()
def shared(
    version: Annotated[
        bool,
        typer.Option("--version", help="print the version and stop", callback=print_version, is_eager=True),
    ] = False,
) -> None:
    """Take the options that belong to no command."""


app.command()(with_options(machines))
app.command()(with_options(info))
app.command()(with_options(check))
app.command("import")(with_options(import_machine))
app.command()(with_options(urdf))
describing = typer.Typer(cls=MachineCommands, no_args_is_help=True, help="Describe a machine.")
app.add_typer(describing, name="machine")
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
app.command()(with_options(compare))
app.command()(with_options(job))
