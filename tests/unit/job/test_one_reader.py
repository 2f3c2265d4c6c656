"""A program has the same rows, operations and findings, whoever reads it."""

from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base import Reading
from fiveaxis.base.errors import ToolpathError
from fiveaxis.job import post_program
from fiveaxis.model import Limits, Machine, load_machine, with_powers
from fiveaxis.nc.source import load_source
from fiveaxis.nc.traced_program import load_program

# What only one view of the rows can say: long turns and kinds of work of a path, angles of a motion.
OF_ONE_VIEW = {"long-turn", "long-turns", "no-simultaneous-path", "angles-assumed", "feed-assumed"}
FILES = {
    "linuxcnc_boat_xyzac.ngc": "linuxcnc-xyzac-trt",
    "linuxcnc_impeller_xyzac.ngc": "linuxcnc-xyzac-trt",
    "nx_dmu70_840d_traori_inch.mpf": "dmu50ev",
    "nx_dmc160u_millplus.nc": "dmu50ev",
    "nx_nmv5000_fanuc_mm.nc": "dmu50ev",
    "spinner_achskreuz_840D_mm.mpf": "linuxcnc-xyzbc-trt",
    "nx_ust_a.cls": "hayashi-640123",
    "solidworks_boss_3axis.apt": "hayashi-640123",
}
# What a program needs that it doesn't state.
OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G54.1P1", "G54.1P2", "G54.1P3")
ZEROS = {f"{offset}{letter}": 0.0 for offset in OFFSETS for letter in "XYZBC"}
NEEDED = {"nx_nmv5000_fanuc_mm.nc": {"start": {"C": 0.0}, "zero": ZEROS}}
RETRACTED = "G21 G90 G94\nT1 M6\nG0 X0 Y0 Z5 A0 C0\nG1 X9 A-20 F100\nG53 G0 Z0\nG0 X20\nZ5\nG1 X30 A-10\n"


def powered(name: str) -> Machine:
    """Return a machine of known speeds and powers whose travel no program exceeds."""
    machine = load_machine(name)
    axes = tuple(replace(a, limits=Limits(), max_speed=a.max_speed or 100.0) for a in machine.axes)
    return with_powers(replace(machine, axes=axes), "estimated")


def codes(findings):
    return {finding.code for finding in findings} - OF_ONE_VIEW


@pytest.mark.parametrize("name", sorted(FILES))
def test_path_motion_and_energy_of_real_programs_are_of_the_same_rows(data, name):
    file, machine = data / "toolpaths" / name, powered(FILES[name])
    needed = NEEDED.get(name, {})
    operations = fx.read_operations(file, machine=machine, **needed)
    assert [o.number for o in operations] == list(range(1, len(operations) + 1))
    for operation in {operations[0].number: operations[0], operations[-1].number: operations[-1]}.values():
        reading = {"operation": operation.number, **needed}
        path = fx.read_toolpath(file, tool=fx.Tool.ball(6), machine=machine, **reading)
        read = load_program(load_source(file), machine, None, Reading(**reading)).motion
        priced = fx.program_energy(file, machine, corners="programmed", **reading)
        assert path.operation == read.operation == priced.motion.operation == operation
        assert {operation.first_line, operation.last_line} <= set(path.source.tolist())
        # A dwell is a row of a motion, but no location of a path.
        assert set(path.source.tolist()) <= set(read.source.tolist()) == set(priced.motion.source.tolist())
        given = codes(path.findings) - {"tool-differs", "tool-unread"}
        assert given == codes(read.findings) <= codes(priced.findings)


def test_a_list_of_cutter_locations_is_posted_with_its_postures_and_verified(data, hayashi):
    file = data / "toolpaths" / "nx_ust_a.cls"
    posted = post_program(file, powered("hayashi-640123"), control="linuxcnc")
    path = fx.read_toolpath(file, tool=fx.Tool.ball(6))
    assert posted.made.gate.verified
    assert posted.made.ok
    tip, axis = hayashi.forward(posted.motion.positions)
    np.testing.assert_allclose(tip, path.tips(path.axis), atol=1e-9)
    np.testing.assert_allclose(axis, path.axis, atol=1e-9)


def test_contacts_without_axes_are_refused_by_energy_and_post(tmp_path, hayashi):
    file = tmp_path / "contacts.csv"
    file.write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n")
    for refuse in (
        lambda: fx.program_energy(file, hayashi),
        lambda: post_program(file, hayashi, control="linuxcnc"),
    ):
        with pytest.raises(ToolpathError, match="no tool axes; choose them first"):
            refuse()


def test_a_way_that_nobody_knows_costs_nothing_known_and_is_never_posted(tmp_path):
    file, machine = tmp_path / "part.nc", powered("hayashi-640123")
    file.write_text(RETRACTED)
    found = fx.program_energy(file, machine, corners="programmed")
    [back] = [row for row in found.rows if row["line"] == 7]
    assert (back["time"], back["energy"]) == (0.0, 0.0)
    assert {"machine-zero-moves", "start-unknown"} <= codes(found.findings)
    known = fx.program_energy(file, machine, corners="programmed", zero={"Z": -300})
    assert known.energy.time > found.energy.time
    assert known.energy.total > found.energy.total
    assert codes(known.findings).isdisjoint({"machine-zero-moves", "start-unknown"})
    with pytest.raises(ToolpathError, match=r"1 moves between cuts.*set zero") as caught:
        post_program(file, machine, control="linuxcnc")
    assert caught.value.line == 7
    assert post_program(file, machine, control="linuxcnc", zero={"Z": -300}).program.lines
    # After the last cut it is only a retract, which the new program leaves out.
    file.write_text(RETRACTED.removesuffix("G1 X30 A-10\n"))
    posted = post_program(file, machine, control="linuxcnc")
    assert posted.motion.source[-1] == 4
