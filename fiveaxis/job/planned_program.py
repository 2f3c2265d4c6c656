"""From postures to the program's motion: blocks inserted and removed, lead-in, lead-out, approach."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Finding
from fiveaxis.check import Leads, Surroundings, Tolerances, choose_leads, surface_at_contacts
from fiveaxis.model import Constraints, Fill, Filling, Machine, Motion, ProgramMotion, Toolpath
from fiveaxis.nc import ProgramSettings, WordWriter


@dataclass(frozen=True, eq=False)
class PlannedProgram:
    """A program's motion before it becomes text.

    Parameters
    ----------
    motion : every move of the program
    fill : the locations that the path's blocks stand for
    leads : lead-in and lead-out
    retract : mm, axis value of Z where it ends; None where it doesn't go up, or where that value isn't known
    """

    motion: ProgramMotion
    fill: Fill
    leads: Leads
    retract: float | None = None

    def located(self, findings: Iterable[Finding]) -> tuple[Finding, ...]:
        """Place the findings of the writer, which name rows of the motion, at locations of the path."""
        path, rows = self.fill.path, self.fill.rows_in(self.motion)[self.motion.first :]
        return tuple(
            f if f.place.location is None else replace(f, place=path.place(int(rows[f.place.location])))
            for f in findings
        )

    def without_redundant(self, constraints: Constraints, wording: WordWriter) -> PlannedProgram:
        """Remove the blocks without which the motion stays within its tolerances."""
        fill = Filling.of(constraints, wording.interpolation).thin(self.fill)
        return replace(self, fill=fill, motion=_around(fill, self.leads, wording, self.retract))


def plan_program(
    motion: Motion,
    toolpath: Toolpath,
    constraints: Constraints,
    around: Surroundings,
    wording: WordWriter,
    settings: ProgramSettings,
    tolerances: Tolerances,
) -> PlannedProgram:
    """Plan what a program does between the locations of a path, before them and after them.

    Every location has its block; further blocks are inserted where the tool would leave its path. Lead-in and
    lead-out are chosen clear of part, stock, fixtures and machine.
    """
    machine, is_program = wording.machine, wording.dialect.language == "blocks"
    fill = Filling.of(constraints, wording.interpolation).fill(toolpath, machine, motion)
    none = np.zeros(len(machine.letters))
    if is_program and around.part is None:
        # Without a mesh of the part, leads keep clear of the surface at the path's contacts.
        around = replace(around, part=surface_at_contacts(toolpath))
    # Whoever posts a list of cutter locations adds the approach.
    leads = (
        choose_leads(
            fill.motion,
            machine,
            toolpath,
            surroundings=around,
            tolerances=tolerances,
            tcp=wording.coordinates != "axes",
            retract=_retract(settings),
            rises=settings.retract is not None,
            leaves=settings.way_out,
        )
        if is_program
        else Leads(none, none)
    )
    retract = _known_retract(settings, machine) if is_program else None
    return PlannedProgram(_around(fill, leads, wording, retract), fill, leads, retract)


def may_thin(wording: WordWriter) -> bool:
    """Check whether it is known how a control moves between two blocks far apart.

    Tool directions leave the angles in between to the control; a tip in a frame that doesn't turn with the
    table leaves it the path; a list of cutter locations leaves it everything.
    """
    if wording.dialect.language != "blocks" or wording.coordinates == "vector":
        return False
    return wording.coordinates == "axes" or wording.mode.positions == "table"


def _around(fill: Fill, leads: Leads, wording: WordWriter, retract: float | None) -> ProgramMotion:
    return ProgramMotion.around(
        fill.blocks,
        wording.machine,
        wording.interpolation,
        lead_in=leads.lead_in,
        lead_out=leads.lead_out,
        retract=retract,
    )


def _retract(settings: ProgramSettings) -> float | None:
    """Return the machine position of Z, mm, to which a program goes up at its end, if it does."""
    if settings.retract is None and settings.home.split()[:1] == ["Z"]:
        return 0.0
    return settings.retract


def _known_retract(settings: ProgramSettings, machine: Machine) -> float | None:
    """Return the same as an axis value: only a machine with known travel counts Z from the control's zero."""
    z = _retract(settings)
    if z is None or "Z" not in machine.letters:
        return None
    axis = machine.axes[machine.column("Z")]
    if None in axis.limits.ends:
        return None
    return -z if axis.reversed else z
