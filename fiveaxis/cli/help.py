"""How a command shows its options: the most used first, and with ``--help-all`` all of them in groups."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import typer
from typer.core import TyperCommand

from fiveaxis.cli.process import write_results

# Options that ``--help`` shows at most, with those for help.
MOST_SHOWN = 14
ALL = "--help-all"
# Place of a command's own options, behind the machine and the output; and of what only ``--help-all`` shows.
OWN, LAST = 3, 90
# Places of parameters in ``--help``, 1 first; those of groups have the ranks of their options.
RANKS: dict[str, int] = {"output": 2, "tool": 4, "verbose": LAST, "quiet": LAST}
HELP = ("help_all", "help")


def show_all(context: typer.Context, wanted: bool) -> None:
    """Print the help with every option and stop, if it is asked for."""
    if wanted:
        context.meta[ALL] = True
        write_results(context.get_help() + "\n")
        raise typer.Exit


class Command(TyperCommand):
    """A command whose help is of two lengths."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the arguments, and the most used options or all of them, group by group."""
        params = [param for param in self.get_params(ctx) if not getattr(param, "hidden", False)]
        sections: dict[str, list[Any]] = {"Arguments": [p for p in params if p.param_type_name == "argument"]}
        options = [param for param in params if param.param_type_name == "option"]
        if ctx.meta.get(ALL):
            for option in options:
                panel = getattr(option, "rich_help_panel", None) or "Options"
                sections.setdefault(panel, []).append(option)
        else:
            sections["Options"] = most_used(options)
        for title, members in sections.items():
            records = [record for member in members if (record := member.get_help_record(ctx)) is not None]
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Name the way to the options that aren't shown."""
        options = [param for param in self.get_params(ctx) if param.param_type_name == "option"]
        if len(options) > MOST_SHOWN and not ctx.meta.get(ALL):
            formatter.write_paragraph()
            formatter.write_text(f"{ALL} shows all {len(options)} options, in groups.")


def most_used(options: list[Any], ranks: Mapping[str, int] = RANKS) -> list[Any]:
    """Return the options that ``--help`` shows, the most used first."""
    last = [option for option in options if option.name in HELP]
    others = sorted((o for o in options if o.name not in HELP), key=lambda o: ranks.get(o.name, OWN))
    return [*others[: MOST_SHOWN - len(last)], *last]
