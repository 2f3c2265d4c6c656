"""The phase of the set-up on the table, and how many rewinds it takes."""

import re
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base import Array
from fiveaxis.model import Limits, Machine, Tool, Toolpath
from fiveaxis.posture.turns.rewinding import insert_rewinds
from fiveaxis.posture.turns.unwrapped import better_phases, count_rewinds


def one_turn(machine: Machine) -> Machine:
    """The machine with C from 0 to 360 deg."""
    limits = Limits(0.0, 2.0 * np.pi)
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    return replace(machine, axes=axes)


def rings(first: float, *, links: int = 6) -> tuple[Toolpath, Array]:
    """Three rings of 330 deg, joined by links clear of the part, with C from an angle on, deg."""
    c = np.radians(first + 5.0 * np.arange(3 * 72))
    n = len(c)
    normal = np.stack([-np.sin(c), np.cos(c), np.zeros(n)], axis=1)
    contact = 20.0 * normal + np.outer(np.arange(n) * 0.02, [0.0, 0.0, 1.0])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6))
    air = np.arange(n) % 72 >= 72 - links
    path = path.with_links(air)
    path = replace(path, pivot=path.pivot + np.where(air[:, None], 60.0 * normal, 0.0))
    return path, np.stack([c, np.full(n, np.radians(-45.0))], axis=1)


def test_a_part_turned_as_suggested_needs_as_many_rewinds_as_announced(hayashi):
    machine = one_turn(hayashi)
    path, rotary = rings(100.0)
    found = insert_rewinds(path, machine, rotary)
    assert sum(r.in_cut for r in found.rewinds) == 3
    [finding] = better_phases(path, machine, rotary, found)
    assert finding.code == "rewind-phase"
    angle = float(re.search(r"is ([+-]\d+) deg more", finding.message).group(1))
    assert finding.value == angle
    # Every point of the part turned about C, which passes through the origin.
    turned, angles = rings(100.0 + angle)
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    about = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(turned.pivot, path.pivot @ about.T, atol=1e-9)
    other = insert_rewinds(turned, machine, angles)
    within = sum(r.in_cut for r in other.rewinds)
    assert within == 0
    assert f"rewind 0 times within a cut and {len(other.rewinds)} times between cuts" in finding.message


@pytest.mark.parametrize("first", [100.0, 3.0, 20.0, 250.0])
def test_rewinds_are_counted_as_they_are_planned(hayashi, first):
    machine = one_turn(hayashi)
    path, rotary = rings(first)
    found = insert_rewinds(path, machine, rotary).rewinds
    within = sum(r.in_cut for r in found)
    assert count_rewinds(path, rotary[:, 0], machine.axis("C").limits) == (within, len(found) - within)


def test_there_is_no_finding_where_no_cut_is_interrupted(hayashi):
    machine = one_turn(hayashi)
    path, rotary = rings(20.0)
    found = insert_rewinds(path, machine, rotary)
    assert found.rewinds
    assert not any(r.in_cut for r in found.rewinds)
    assert better_phases(path, machine, rotary, found) == []


def test_there_is_no_finding_where_every_phase_interrupts_as_many_cuts(hayashi):
    machine = one_turn(hayashi)
    path, rotary = rings(0.0, links=0)
    found = insert_rewinds(path, machine, rotary)
    assert len(found.rewinds) == 2
    assert better_phases(path, machine, rotary, found) == []
