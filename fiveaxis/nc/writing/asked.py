"""What a job asks of a program besides its moves: spindle, tool, offsets, coolant."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.nc.control.technology import Technology, read_technology
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.framing import Frame
from fiveaxis.nc.writing.program_settings import ProgramSettings
from fiveaxis.nc.writing.wording import Wording


@dataclass(frozen=True)
class AskedTechnology:
    """What has to be in force in every cut.

    Parameters
    ----------
    language : of the control's programs
    technology : spindle and tool as in the settings, offsets and coolant as the control's words for the
        settings put them in force
    retracts, goes_clear : whether Z goes to a machine position before the cuts, and after them
    spindle, tool, coolant : whether the settings give them; what they don't give isn't checked
    """

    language: str
    technology: Technology
    spindle: bool
    tool: bool
    coolant: bool
    retracts: bool = False
    goes_clear: bool = False

    @classmethod
    def of(cls, wording: Wording, settings: ProgramSettings) -> AskedTechnology | None:
        """Read what the head of a control's program puts in force; None for a list of cutter locations."""
        dialect = wording.dialect
        if dialect.language != "blocks":
            return None
        source = Source(f"program{dialect.suffix}", Frame(wording, settings, "unwound").before_cuts())
        reader = read_technology(source)
        technology = reader.now
        # Numbers are those of the settings, whatever the table makes of them.
        if settings.spindle_rpm is not None:
            sense = -1.0 if settings.spindle_direction == "left" else 1.0
            technology = technology._replace(speed=settings.spindle_rpm, sense=sense)
        if settings.tool_number is not None:
            technology = technology._replace(tool=str(settings.tool_number))
        return cls(
            language=reader.language.name,
            technology=technology,
            spindle=settings.spindle_rpm is not None,
            tool=settings.tool_number is not None,
            coolant=settings.coolant is not None,
            retracts=settings.retract is not None,
            goes_clear=settings.goes_clear,
        )
