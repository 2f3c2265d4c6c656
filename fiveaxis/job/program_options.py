"""How a motion becomes a program: control, coordinates, settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Unpack, cast

from fiveaxis.machine import Machine
from fiveaxis.motion import Coordinates
from fiveaxis.nc import ProgramSettings, control_for, find_dialect, require_program
from fiveaxis.nc.formats import require_program_suffix
from fiveaxis.nc.writing.start_and_end import RequiredTechnology
from fiveaxis.nc.writing.word_writer import WordWriter
from fiveaxis.options import Writing, completed

Header = Mapping[str, str]


@dataclass(frozen=True)
class ProgramOptions:
    """How a motion becomes a program.

    Parameters
    ----------
    writing : all options of the group
    settings : of the program besides its moves
    header : comments by name
    """

    writing: Writing
    settings: ProgramSettings
    header: Header | None = None

    @classmethod
    def of(
        cls,
        settings: ProgramSettings | None = None,
        header: Header | None = None,
        machine: Machine | None = None,
        **writing: Unpack[Writing],
    ) -> ProgramOptions:
        """Make the record of what is given, with the defaults of the rest.

        Parameters
        ----------
        machine : whose control is the default

        Raises
        ------
        SettingError
            An unknown word.
        MachineError
            The machine's control is unknown.
        """
        if machine is not None:
            writing["control"] = control_for(machine, writing.get("control"))
        every = cast("Writing", completed(Writing, writing))
        return cls(every, settings or ProgramSettings(), header)

    def wording(self, machine: Machine) -> WordWriter:
        """Check that the control can write a machine's motions so; return how positions become its words.

        Raises
        ------
        FiveAxisError
            As `require_program`.
        """
        words = self.writing
        return require_program(
            machine, words["control"], words["coordinates"], words["winding"], self.settings
        )

    def named(self, name: str) -> ProgramOptions:
        """Name the program, unless the settings do."""
        return replace(self, settings=self.settings.named(name))

    def for_file(self, path: str | Path) -> ProgramOptions:
        """Name the program after its file, unless the settings do.

        Raises
        ------
        SettingError
            The file's suffix is that of no program.
        """
        require_program_suffix(path, find_dialect(self.writing["control"]).suffix)
        return self.named(Path(path).stem)

    def asked(self, machine: Machine, mode: Coordinates) -> RequiredTechnology | None:
        """Return what is asked of a program in coordinates that need not be these.

        Raises
        ------
        FiveAxisError
            As `require_program`.
        """
        modes = find_dialect(self.writing["control"]).modes
        coordinates = mode if mode in modes else next(iter(modes))
        writing: Writing = {**self.writing, "coordinates": coordinates}
        asked = RequiredTechnology.of(replace(self, writing=writing).wording(machine), self.settings)
        if asked is None or mode in modes:
            return asked
        # What F means depends on the coordinates.
        return replace(asked, technology=asked.technology._replace(feed_mode=""))
