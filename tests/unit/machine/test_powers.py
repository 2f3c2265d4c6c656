"""Borrowed drives map by role, not by letter."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fiveaxis.errors import MachineError, UnknownMachine
from fiveaxis.machine import DirectionalDrive, Machine, WeightDrive, load_machine
from fiveaxis.machine.powers import describe_powers, lender_of, with_powers


def test_rotary_axes_borrow_by_their_place_in_the_chain():
    machine = with_powers(load_machine("umc-750"), "hayashi-640123")
    hayashi = load_machine("hayashi-640123")
    assert machine.axis("B").drive == hayashi.axis("A").drive
    assert machine.axis("C").drive == hayashi.axis("C").drive
    text = describe_powers(machine)
    assert "B from A of hayashi-640123" in text
    assert not machine.bands


def test_the_axis_to_take_can_be_named():
    machine = with_powers(load_machine("umc-750"), "hayashi-640123:B=C,C=A")
    hayashi = load_machine("hayashi-640123")
    assert machine.axis("B").drive == hayashi.axis("C").drive
    assert machine.axis("C").drive == hayashi.axis("A").drive
    assert lender_of("hayashi-640123:B=C") == "hayashi-640123"


def test_the_axis_against_gravity_takes_the_drive_of_the_one_against_gravity():
    """Where Y is up it takes the powers of Z; if it counts downwards, with the sides exchanged."""
    hayashi = load_machine("hayashi-640123")
    lying = replace(Machine.from_code("640123"), vertical=(0.0, 1.0, 0.0))
    assert lying.with_drives_of(hayashi).axis("Y").drive == hayashi.axis("Z").drive
    hanging = replace(lying, vertical=(0.0, -1.0, 0.0))
    drive, own = hanging.with_drives_of(hayashi).axis("Y").drive, hayashi.axis("Z").drive
    assert isinstance(drive, DirectionalDrive)
    assert (drive.plus, drive.minus) == (own.minus, own.plus)


def test_a_table_that_goes_up_takes_the_drive_of_a_head_that_goes_up(hayashi):
    """The value of a table's axis, tool relative to workpiece, falls while the table goes up."""
    table = Machine.from_code("641302").with_drives_of(hayashi)
    assert (table.axis("Z").drive.plus, table.axis("Z").drive.minus) == (427.8, 612.1)


def test_a_drive_that_needs_a_mass_brings_it_along():
    machine = Machine.from_code("0123").with_drives_of(load_machine("takisawa-mac-v3"))
    assert isinstance(machine.axis("X").drive, WeightDrive)
    assert machine.axis("X").moved_mass == 315.0


def test_a_machine_with_fewer_axes_or_without_powers_is_refused_with_what_to_write():
    machine = load_machine("umc-750")
    with pytest.raises(MachineError, match=r"takisawa-mac-v3' has no rotary \d axis.*--drives takisawa"):
        with_powers(machine, "takisawa-mac-v3")
    with pytest.raises(MachineError, match="has no power of"):
        with_powers(machine, "dmu50ev")
    with pytest.raises(MachineError, match="has no axis 'A'"):
        with_powers(machine, "hayashi-640123:A=A")
    with pytest.raises(UnknownMachine):
        with_powers(machine, "hayashi:B=A")
