"""Finish the walls of a block with a wide holder beside a clamp: plan on the mesh, keep clear, verify.

A cheap posture is worth nothing if the holder hits the clamp or the wall above the cutter. Bodies restrict
the postures at each location, so the energy can only be higher than without them. Verification checks the
same bodies with other code, at every location and along every move between them.
"""

from __future__ import annotations

import trimesh

import fiveaxis as fx
from fiveaxis.base import Workpiece
from fiveaxis.check import Fixture, Surroundings
from fiveaxis.model import Box, Holder, Section

TILT = (15, 75)  # degrees between tool axis and surface normal


def main() -> None:
    part = trimesh.creation.box((16.0, 16.0, 10.0))  # stands on z = 0; a mesh's file name does as well
    part.apply_translation((0.0, 0.0, 5.0))
    machine = fx.load_machine("hayashi-640123")
    holder = Holder(stick_out=30.0, sections=(Section(length=40.0, diameter=40.0),))  # mm
    tool = fx.Tool.ball(8, shank_diameter=7.0, holder=holder)
    clamp = Fixture("clamp", Box(size=(20.0, 40.0, 20.0), center=(35.0, 0.0, 10.0)))  # mm, workpiece frame
    around = Surroundings.of(Workpiece(part=part), fixtures=(clamp,))

    toolpath = fx.plan_contour(part, tool, stepdown=10, spacing=1.0)
    print(f"planned {len(toolpath)} locations, {int(toolpath.cutting.sum())} of them cuts")
    blind = fx.optimise(toolpath, machine, tilt=TILT, effort="quick")
    clear = fx.optimise(toolpath, machine, tilt=TILT, effort="quick", part=part, fixtures=(clamp,))
    for name, solution in (("blind", blind), ("clear", clear)):
        # The control is to lead the tool straight between locations (tool centre point control).
        report = fx.verify(
            solution.motion, machine, solution.toolpath, tilt=TILT, surroundings=around, between="tcp"
        )
        print(f"{name}: {solution.energy.total:.0f} J, verified {report.ok}, findings {dict(report.counts)}")


if __name__ == "__main__":
    main()
