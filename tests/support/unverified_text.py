"""What tests of texts share: a program's text as a file, written by nothing but the composer."""

from pathlib import Path
from typing import Any

from fiveaxis.base.files import write_atomically
from fiveaxis.model import Machine, Motion, ProgramMotion
from fiveaxis.nc import ProgramSettings, compose_program


def write_text(motion: Motion | ProgramMotion, path: str | Path, *, machine: Machine, **words: Any) -> Path:
    """Write the text of a motion, unverified; a control that names its programs takes the file's name."""
    settings = words.pop("settings", None) or ProgramSettings()
    if settings.name is None:
        settings = settings.model_copy(update={"name": Path(path).stem[:60] or None})
    return write_atomically(path, compose_program(motion, machine=machine, settings=settings, **words).text)
