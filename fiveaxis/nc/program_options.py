"""How a motion becomes a program: control, coordinates, settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from fiveaxis.base import USUAL_CONTROL, Coordinates, Writing
from fiveaxis.model import Machine
from fiveaxis.nc.formats import require_program_suffix
from fiveaxis.nc.program import control_for, require_program
from fiveaxis.nc.writing.program_settings import ProgramSettings
from fiveaxis.nc.writing.start_and_end import RequiredTechnology
from fiveaxis.nc.writing.tables import Dialect, find_dialect
from fiveaxis.nc.writing.word_writer import WordWriter

Header = Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class ProgramOptions(Writing):
    """How a motion becomes a program: all options of `Writing`, and what only code can give.

    Parameters
    ----------
    settings : of the program besides its moves: tool, spindle, coolant, work offset and so on
    header : name and value of further comments
    """

    settings: ProgramSettings = ProgramSettings()  # noqa: RUF009 -- it is frozen
    header: Header | None = None

    def on(self, machine: Machine) -> Self:
        """Return the same for the control of a machine, where none is named.

        Raises
        ------
        MachineError
            The machine's control is unknown.
        """
        return replace(self, control=control_for(machine, self.control))

    @property
    def dialect(self) -> Dialect:
        """The control's table."""
        return find_dialect(self.control or USUAL_CONTROL)

    def wording(self, machine: Machine) -> WordWriter:
        """Check that the control can write a machine's motions so; return how positions become its words.

        Raises
        ------
        FiveAxisError
            As `require_program`.
        """
        control = self.control or USUAL_CONTROL
        return require_program(machine, control, self.coordinates, self.winding, self.settings)

    def named(self, name: str) -> Self:
        """Name the program, unless the settings do."""
        return replace(self, settings=self.settings.named(name))

    def for_file(self, path: str | Path) -> Self:
        """Name the program after its file, unless the settings do.

        Raises
        ------
        SettingError
            The file's suffix is that of no program.
        """
        require_program_suffix(path, self.dialect.suffix)
        return self.named(Path(path).stem)

    def required(self, machine: Machine, mode: Coordinates) -> RequiredTechnology | None:
        """Return what is asked of a program in coordinates that need not be these.

        Raises
        ------
        FiveAxisError
            As `require_program`.
        """
        modes = self.dialect.modes
        coordinates = mode if mode in modes else next(iter(modes))
        wording = replace(self, coordinates=coordinates).wording(machine)
        required = RequiredTechnology.of(wording, self.settings)
        if required is None or mode in modes:
            return required
        # What F means depends on the coordinates.
        return replace(required, technology=required.technology._replace(feed_mode=""))
