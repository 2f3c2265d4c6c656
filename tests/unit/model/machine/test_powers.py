"""Powers that nobody has measured: borrowed by role, not by letter, or estimated.

Estimates are held against machines whose powers are measured, and against what they follow from.
"""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError, UnknownMachine
from fiveaxis.model import (
    DirectionalDrive,
    FrictionDrive,
    Machine,
    WeightDrive,
    check_machine,
    load_machine,
    machine_names,
    save_machine,
)
from fiveaxis.model.energy.drives import axis_powers
from fiveaxis.model.machine.powers import describe_powers, lender_of, with_powers

FEED = 1000.0


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


def powers(machine: Machine) -> np.ndarray:
    """Power of each axis alone at F1000, up and down, (2, k) W."""
    rotary = np.array([a.is_rotary for a in machine.axes])
    speed = np.where(rotary, np.radians(FEED), FEED) / 60.0
    every = np.concatenate([np.diag(speed), -np.diag(speed)])
    found = axis_powers(machine, np.zeros_like(every), every)
    return np.diagonal(found.reshape(2, len(speed), -1), axis1=1, axis2=2)


@pytest.mark.parametrize("name", ["hayashi-640123", "takisawa-mac-v3"])
def test_measured_powers_lie_within_the_bands_of_the_estimates(name):
    measured, estimated = load_machine(name), with_powers(load_machine(name), "estimated")
    low, high = np.array([estimated.bands[c] for c in estimated.letters]).T
    ratio = powers(measured) / powers(estimated)
    assert (ratio >= low).all()
    assert (ratio <= high).all()
    # A band that reached far beyond what is measured would say nothing.
    assert max(ratio.max(), 1.0 / ratio.min()) > 0.8 * high.max()


@pytest.mark.parametrize("name", machine_names())
def test_every_library_machine_has_powers_by_default_and_its_own_stay(name):
    machine = load_machine(name)
    full = with_powers(machine)
    assert full.has_powers
    assert (powers(full) > 0.0).all()
    for axis, own in zip(full.axes, machine.axes, strict=True):
        assert own.drive is None or axis.drive is own.drive
        assert (axis.letter in full.bands) == (own.drive is None)
    assert bool(describe_powers(full)) == (not machine.has_powers)


def test_the_vertical_axis_lifts_its_weight():
    up, down = powers(with_powers(load_machine("umc-750")))
    z = load_machine("umc-750").column("Z")
    assert up[z] > 1.2 * down[z]
    np.testing.assert_allclose(np.delete(up, z), np.delete(down, z))


def test_an_estimate_follows_from_mass_motor_machine_or_travels_in_this_order():
    bare = Machine.from_code("640123")

    def of_x(**figures):
        axes = tuple(replace(a, **figures) if a.letter == "X" else a for a in bare.axes)
        return with_powers(replace(bare, axes=axes)).axis("X")

    assert of_x(moved_mass=50.0).moved_mass == 50.0
    motor = of_x(motor_power=2000.0, max_speed=500.0, max_acceleration=5000.0)
    # 3 × 2 kW × 0.8 at 0.5 m/s are 9 600 N, for 5 m/s² and friction of 0.16 g.
    assert motor.moved_mass == pytest.approx(9600.0 / (5.0 + 0.16 * 9.80665))
    assert motor.drive.moving == pytest.approx(0.04 * 2000.0)
    heavy, light = (with_powers(replace(bare, size=replace(bare.size, mass=m))) for m in (10_000.0, 5_000.0))
    assert heavy.axis("Y").moved_mass == pytest.approx(2.0 * light.axis("Y").moved_mass)
    small = with_powers(replace(bare, size=replace(bare.size, kind="desktop")))
    assert small.axis("Z").moved_mass < 0.2 * with_powers(bare).axis("Z").moved_mass


def test_an_axis_carries_those_between_it_and_the_part_or_the_tool():
    masses = {a.letter: a.moved_mass for a in with_powers(Machine.from_code("640123")).axes}
    assert masses["X"] == pytest.approx(3.0 * masses["Z"])
    assert masses["A"] > masses["C"]


def test_estimates_and_motors_are_written_and_read_back(tmp_path):
    machine = load_machine("umc-750")
    axes = tuple(replace(a, motor_power=1500.0) if a.letter == "Y" else a for a in machine.axes)
    full = with_powers(replace(machine, axes=axes))
    again = load_machine(save_machine(full, tmp_path / "mine.toml"))
    assert again.bands == full.bands
    assert again.axis("Y").motor_power == 1500.0
    assert isinstance(again.axis("X").drive, FrictionDrive)
    np.testing.assert_allclose(powers(again), powers(full))
    assert not [f for f in check_machine(tmp_path / "mine.toml") if f.severity == "error"]


@pytest.mark.parametrize(
    ("figures", "message"),
    [
        ("motor = { power = 2500, source = 'nameplate' }", "200"),
        ("motor = { current = 5, source = 'nameplate' }", "current .* and voltage"),
        ("moved_mass = { value = 0, source = 'owner' }", "0"),
        ("moved_mass = { value = 9e6, source = 'owner' }", "500000"),
        ("drive = { model = 'friction', friction = 5, band = [2, 3], source = 'owner' }", "band"),
    ],
)
def test_figures_out_of_any_range_are_refused(tmp_path, figures, message):
    file = tmp_path / "mine.toml"
    file.write_text(f'name = "mine"\ncode = "640123"\n[axes.X]\n{figures}\n', encoding="utf-8")
    with pytest.raises(MachineError, match=message):
        load_machine(file)
