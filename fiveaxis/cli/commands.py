"""The commands of the command line."""

from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from fiveaxis.cli.batch_verb import batch, compare
from fiveaxis.cli.calibration_verb import calibrate
from fiveaxis.cli.energy_verb import energy
from fiveaxis.cli.filter_verb import filter_program
from fiveaxis.cli.help import Command
from fiveaxis.cli.job_verb import job
from fiveaxis.cli.machine_verbs import check, import_machine, info, machines, urdf
from fiveaxis.cli.page_verb import serve_page
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

        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(cmd_name, cls=Command)(new)
        return get_command(alone)


app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Choose the tool posture of a 5-axis path that costs the machine the least energy. `fiveaxis app` "
    "opens a page to drop a program or a part into.",
)


def print_version(wanted: bool) -> None:
    """Print the version and stop, if it is asked for."""
    if wanted:
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


# In the order of `fiveaxis --help`, the most used first.
VERBS: dict[str, Callable[..., None]] = {
    "app": serve_page,
    "optimise": optimise,
    "verify": verify,
    "energy": energy,
    "plan": plan,
    "preview": preview,
    "post": post,
    "filter": filter_program,
    "info": info,
    "job": job,
    "batch": batch,
    "compare": compare,
    "surface": surface,
    "calibrate": calibrate,
    "controls": controls,
    "machines": machines,
    "check": check,
    "import": import_machine,
    "urdf": urdf,
}
for name, verb in VERBS.items():
    # A tip like -10,0,5 looks like an option; unknown options are taken as arguments.
    app.command(name, cls=Command, context_settings={"ignore_unknown_options": verb is surface})(verb)
describing = typer.Typer(
    cls=MachineCommands, no_args_is_help=True, rich_markup_mode=None, help="Describe a machine."
)
app.add_typer(describing, name="machine")
