"""The command that serves the page into which a program or a part is dropped."""

from __future__ import annotations

from typing import Annotated

import typer

from fiveaxis.base import SettingError
from fiveaxis.cli.options import takes
from fiveaxis.cli.terminal import errors_explained, out


@takes()
def serve_page(
    port: Annotated[int, typer.Option(help="of this computer; 0 takes a free one", min=0, max=65535)] = 0,
    browser: Annotated[bool, typer.Option(help="open the page in a browser")] = True,
) -> None:
    """Open a page in a browser: drop a program or a part, see it as it is, improve it, download it."""
    with errors_explained(False):
        from fiveaxis.cli.page.server import serve

        try:
            serve(port, lambda address: out.print(f"fiveaxis app at {address} until Ctrl-C"), browser=browser)
        except OSError as fault:
            raise SettingError(f"port {port} can't be opened: {fault.strerror}; leave --port out") from None
