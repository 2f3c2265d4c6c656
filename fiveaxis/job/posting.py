"""From one control to another: a program, or the table of a motion, written for a machine's control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fiveaxis.errors import ToolpathError
from fiveaxis.files import write_atomically
from fiveaxis.findings import Finding
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.nc import (
    Coordinates,
    Program,
    ProgramMotion,
    ProgramSettings,
    compose_program,
    read_motion,
    read_program,
)
from fiveaxis.nc.gate import Verdict
from fiveaxis.nc.options import Wrap
from fiveaxis.nc.writing.turns import Winding
from fiveaxis.report import describe_input

# The table of a motion, beside the programs.
MOTION_SUFFIX = ".csv"


@dataclass(frozen=True, eq=False)
class Posted:
    """A program written anew.

    Parameters
    ----------
    motion : that was read
    program : that was written
    path : its file; None where none was asked for
    """

    motion: Motion
    program: Program
    path: Path | None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What reading and writing assumed or left out."""
        read = self.motion.findings if isinstance(self.motion, ProgramMotion) else ()
        return (*read, *self.program.findings)


def post_program(
    source: str | Path,
    machine: Machine,
    *,
    control: str | Path = "linuxcnc",
    output: str | Path | None = None,
    coordinates: Coordinates | None = None,
    winding: Winding = "unwound",
    settings: ProgramSettings | None = None,
    report: Verdict | None = None,
    override: Sequence[str] = (),
    unit: Literal["mm", "inch"] | None = None,
    start: Mapping[str, float] | None = None,
    program_zero: Mapping[str, float] | None = None,
    rapid_mm_min: float | None = None,
    block_delete: bool = False,
    wrap: Wrap | None = None,
) -> Posted:
    """Read a motion and write it for a control.

    Every move keeps its duration. Moves of the tip come as the parts in which axes that run straight keep it
    on its way.

    Parameters
    ----------
    source : a program in any language that `read_program` knows, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    output : the new program's file; by default none is written
    control, coordinates, winding, settings, report, override : as for `compose_program`
    unit, start, program_zero, rapid_mm_min, block_delete, wrap : of the source, as for `read_program`

    Raises
    ------
    FiveAxisError
        As `read_motion`, `read_program` and `compose_program`; a file that can't be written.
    """
    source = Path(source)
    if source.suffix.lower() == MOTION_SUFFIX:
        motion: Motion = read_motion(source, machine, source_is_table=True)
    else:
        motion = read_program(
            source,
            machine,
            unit=unit,
            start=start,
            program_zero=program_zero,
            rapid_mm_min=rapid_mm_min,
            block_delete=block_delete,
            wrap=wrap,
        )
    described = describe_input(source)
    settings = settings or ProgramSettings()
    if settings.name is None:
        named = source if output is None else Path(output)
        settings = settings.model_copy(update={"name": named.stem[:60] or None})
    try:
        program = compose_program(
            motion,
            machine=machine,
            control=control,
            coordinates=coordinates,
            header={"source": f"{described['name']} sha256 {described['sha256'][:16]}"},
            winding=winding,
            report=report,
            override=override,
            settings=settings,
        )
    except ToolpathError as fault:  # its line is one of the source
        raise ToolpathError(fault.message, file=source, line=fault.line) from None
    path = None if output is None else write_atomically(output, program.text)
    return Posted(motion, program, path)
