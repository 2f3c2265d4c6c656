"""Verify an NC program or the table of a motion, from any source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fiveaxis.base import Bounds, Meshes, ProgramBounds, Reading, Workpiece, keywords_of, with_default
from fiveaxis.check.collision.surroundings import Clearances, Fixture, Surroundings
from fiveaxis.check.verification.check_context import DEFAULT_TOLERANCES, Tolerances
from fiveaxis.check.verification.program import check_program
from fiveaxis.check.verification.program_rows import Against
from fiveaxis.check.verification.report import Report
from fiveaxis.model import Constraints, Machine, Tool, Toolpath
from fiveaxis.nc import ProgramOptions, ProgramSettings

# deg and deg/mm: turns of a program that are told, within this angle of the first rotary axis.
SINGULAR_CONE, SINGULAR_RATE = 5.0, 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Checking(Workpiece, ProgramBounds, Meshes, Reading):
    """All that `verify_program` takes as keywords: workpiece, bounds, how files are read."""

    tool: Tool | None = None
    toolpath: Toolpath | None = None
    fixtures: tuple[Fixture, ...] = ()
    clearances: Clearances | None = None
    tolerances: Tolerances = DEFAULT_TOLERANCES
    settings: ProgramSettings | None = None
    control: str | Path | None = None
    singular_cone: float | None = with_default(ProgramBounds, "singular_cone", SINGULAR_CONE)
    singular_rate: float = with_default(ProgramBounds, "singular_rate", SINGULAR_RATE)

    @property
    def bounds(self) -> Bounds:
        """The bounds that are checked; the rate is that of a cone."""
        return Bounds.of(self) if self.singular_cone is not None else Bounds.of(self, singular_rate=0.0)


@keywords_of(Checking)
def verify_program(
    program: str | Path,
    machine: Machine,
    given: Checking,
) -> Report:
    """Check an NC program, or the table of a motion, against its machine; part and path are optional.

    Bounds of postures are in **degrees**: tilt, lead and lean relative to the surface normals of
    `toolpath`, or else to those of the part, a cone about the axes of `toolpath`. Without `singular_cone`,
    fast turns within `SINGULAR_CONE` are told.

    Between two blocks all axes run linearly in time; moves under TCP are first split into parts in which such
    axes keep the tip on its path. Between two rows of a motion's table the tool's centre moves in a straight
    line. Anywhere in a program the cutter may reach 0.015 mm deeper than `gouge_tolerance`, since its blocks
    are chords of the path within a tolerance of their own. A program that doesn't state the axis values is
    checked as a path of the tool, with the finding ``angles-assumed``.

    Parameters
    ----------
    program : in any language that `read_program` knows, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    tool : the cutter; by default that of `toolpath`, or as the program's comments state it. Without a tool
        only the tip is followed
    toolpath : that the program should follow: its tool's centre keeps to the path within
        `Tolerances.deviation` and passes all of its locations in order
    fixtures : clamps and vices, workpiece frame, that cutter, shank, holder and machine keep clear of
    clearances : mm, by kind of body
    tolerances : from where on any other difference is a finding
    settings : of the program that was asked for: spindle, tool, offsets and coolant have to be in force in
        every cut
    control : of the program, unless its header names one, and whose words the settings are, as for
        `compose_program`; by default the machine's

    Returns
    -------
    Findings with file and line of the program: ``not-finite``, ``axis-limit``, ``held-axis``, ``tilt``,
    ``gouge``, ``…-collision``, ``off-path``, ``path-missed`` (errors), ``jump`` (an error; a warning where
    the swept cutter was checked for gouges and no bound was given), ``feed-over``, ``singular-turn``,
    ``…-clearance``, ``tip-deviation`` (warnings: a control slows down, and what lies between the blocks of
    somebody else's program is its author's choice), and what was assumed while reading it.

    Raises
    ------
    FiveAxisError
        As `read_program`, `verify` and `find_contacts`; bounds that refer to a path or part that isn't given.
    """
    machine, required = machine.with_control(given.control), None
    if given.settings is not None:
        required = ProgramOptions(control=given.control, settings=given.settings).on(machine)
    against = Against(
        given.toolpath,
        given.tool,
        Surroundings.of(given, given, given.fixtures, given.clearances),
        Constraints.of(given.bounds),
        given.tolerances.with_gouge(given.gouge_tolerance),
        program=required,
        surface_tolerance=given.surface_tolerance,
        part_unit=given.part_unit or "mm",
        crease=given.crease,
    )
    return check_program(program, machine, against, given)
