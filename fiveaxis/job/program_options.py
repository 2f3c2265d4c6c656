"""How a motion becomes a program: control, coordinates, settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from fiveaxis.machine import Machine
from fiveaxis.motion import Coordinates
from fiveaxis.nc import ProgramSettings, find_dialect, require_program
from fiveaxis.nc.formats import require_program_suffix
from fiveaxis.nc.writing.start_and_end import RequiredTechnology
from fiveaxis.nc.writing.turns import Winding
from fiveaxis.nc.writing.word_writer import WordWriter

Header = Mapping[str, str]


@dataclass(frozen=True)
class ProgramOptions:
    """How a motion becomes a program.

    Parameters
    ----------
    control : name of a dialect, or the path of a control table
    coordinates, winding, settings : as for `compose_program`
    thin : whether redundant blocks are removed
    override : codes of errors that are accepted
    header : comments by name
    """

    control: str | Path = "linuxcnc"
    coordinates: Coordinates | None = None
    winding: Winding = "unwound"
    settings: ProgramSettings = field(default_factory=ProgramSettings)
    thin: bool = True
    override: tuple[str, ...] = ()
    header: Header | None = None

    def wording(self, machine: Machine) -> WordWriter:
        """Check that the control can write a machine's motions so; return how positions become its words.

        Raises
        ------
        FiveAxisError
            As `require_program`.
        """
        return require_program(machine, self.control, self.coordinates, self.winding, self.settings)

    def named(self, name: str) -> ProgramOptions:
        """Name the program, unless the settings do."""
        if self.settings.name is not None:
            return self
        return replace(self, settings=self.settings.model_copy(update={"name": name[:60] or None}))

    def for_file(self, path: str | Path) -> ProgramOptions:
        """Name the program after its file, unless the settings do.

        Raises
        ------
        SettingError
            The file's suffix is that of no program.
        """
        require_program_suffix(path, find_dialect(self.control).suffix)
        return self.named(Path(path).stem)

    def asked(self, machine: Machine, mode: Coordinates) -> RequiredTechnology | None:
        """Return what is asked of a program in coordinates that need not be these.

        Raises
        ------
        FiveAxisError
            As `require_program`.
        """
        modes = find_dialect(self.control).modes
        coordinates = mode if mode in modes else next(iter(modes))
        asked = RequiredTechnology.of(replace(self, coordinates=coordinates).wording(machine), self.settings)
        if asked is None or mode in modes:
            return asked
        # What F means depends on the coordinates.
        return replace(asked, technology=asked.technology._replace(feed_mode=""))
