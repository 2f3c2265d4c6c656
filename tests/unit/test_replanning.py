"""What a program breaks between locations goes back to the solver, and the path is solved again."""

from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.errors import Infeasible
from fiveaxis.job import ProgramOptions, make_job, make_program, run_job
from fiveaxis.job.faults import Faults
from fiveaxis.job.replanning import replanning
from fiveaxis.machine import Limits, Machine
from fiveaxis.posture import optimise
from fiveaxis.toolpath import Constraints, Tool, Toolpath

RING = {"tilt": (15.0, 75.0), "effort": "quick"}
HOP = {"tilt": (35.0, 80.0), "max_turn": 60.0, "effort": "quick"}


@pytest.fixture(scope="module")
def wall() -> Toolpath:
    """An S-shaped wall that leans by 20 deg, in steps of 3 mm: the tool hops over its normal between two."""
    x = np.linspace(-60.0, 60.0, 40)
    bend = np.pi * x / 60.0
    out = np.column_stack([-0.5 * np.pi * np.cos(bend), np.ones(40), np.zeros(40)])
    out /= np.linalg.norm(out, axis=1)[:, None]
    normal = np.cos(np.radians(20.0)) * out - np.sin(np.radians(20.0)) * np.array([0.0, 0.0, 1.0])
    contact = np.column_stack([x, 30.0 * np.sin(bend), np.full(40, 20.0)])
    return Toolpath.from_contacts(contact, normal, Tool.ball(8), feed_mm_min=500.0)


@pytest.fixture(scope="module")
def ring() -> Toolpath:
    """A round wall in steps of 3 deg."""
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(121)])
    return Toolpath.from_contacts(30.0 * out + [20.0, 0.0, 30.0], out, Tool.ball(10))


@pytest.fixture(scope="module")
def short(hayashi) -> Machine:
    """A machine that can't go down as far as the cheapest path around the ring wants to."""
    z = hayashi.column("Z")
    axes = [replace(a, limits=Limits(low=18.7)) if i == z else a for i, a in enumerate(hayashi.axes)]
    return replace(hayashi, axes=tuple(axes))


def counts(solution, bounds) -> dict[str, int]:
    asked = Constraints(tilt=bounds["tilt"], max_turn=bounds.get("max_turn"))
    made = make_program(
        solution.motion, solution.machine, solution.toolpath, asked, ProgramOptions(thin=False)
    )
    return dict(made.report.counts)


def test_a_lean_that_dips_between_two_locations_is_replanned(wall, hayashi):
    blind = optimise(wall, hayashi, **HOP)
    assert counts(blind, HOP)["tilt"] > 0
    kept = fx.optimise(wall, hayashi, **HOP)
    assert counts(kept, HOP) == {}
    assert any(stage.name.startswith("local replanning") for stage in kept.stages)
    assert blind.energy.total < kept.energy.total < 1.1 * blind.energy.total
    assert kept.baselines == blind.baselines


def test_an_axis_that_passes_its_travel_between_two_locations_is_kept_inside(ring, short):
    blind = optimise(ring, short, **RING)
    assert set(counts(blind, RING)) == {"axis-limit"}
    kept = fx.optimise(ring, short, **RING)
    assert counts(kept, RING) == {}
    # The machine is the one that was given, and so are the baselines.
    assert kept.machine.axis("Z").limits == short.axis("Z").limits
    assert kept.baselines == blind.baselines
    assert kept.energy.total < 1.01 * blind.energy.total


def test_a_job_takes_the_same_way(wall, hayashi, tmp_path):
    rows = np.hstack([wall.contact, wall.normal])
    file = tmp_path / "wall.csv"
    np.savetxt(file, rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="", fmt="%.9f")
    job = make_job(
        input=file, machine="hayashi-640123", tool="ball:8", feed=500.0, tilt=HOP["tilt"], max_turn=60.0
    )
    outcome = run_job(job.model_copy(update={"effort": "quick"}))
    assert outcome.ok, outcome.program.verdict.counts
    assert any(stage.name.startswith("local replanning") for stage in outcome.solution.stages)


def test_a_path_that_keeps_its_bounds_is_solved_once(ring, hayashi):
    solved = []

    def solve(path, mask, free, within):
        solved.append(within)
        return optimise(path, hayashi, tightened=within, **(RING | {"max_turn": 5.0}))

    replanning(solve, RING)(ring, None, False)
    assert solved == [None]


def test_what_no_path_avoids_is_named_with_what_to_do(wall, hayashi):
    first = optimise(wall, hayashi, **HOP)
    refused = []

    def solve(path, mask, free, within):
        if within is None:
            return first
        refused.append(within)
        raise Infeasible("no way", ())

    best = replanning(solve, HOP)(wall, None, False)
    assert best.motion is first.motion
    # Turning less, and keeping more inside of the bounds.
    assert [bool(np.isfinite(one.turn).any()) for one in refused] == [True, False]
    assert [bool((one.lean > 0.0).any()) for one in refused] == [False, True]
    (finding,) = [f for f in best.toolpath.findings if f.code == "between-locations"]
    assert finding.place.location == int(np.argmax(Faults.of(first, HOP).moves))
    assert "put locations closer together here or widen" in finding.message
    assert "\n" not in finding.message


def test_a_narrower_lean_keeps_the_bounds_between_locations_too(wall, hayashi):
    """The second remedy, where turning less leaves no path."""

    def solve(path, mask, free, within):
        if within is not None and np.isfinite(within.turn).any():
            raise Infeasible("no way", ())
        return optimise(path, hayashi, tightened=within, **HOP)

    kept = replanning(solve, HOP)(wall, None, False)
    assert counts(kept, HOP) == {}
    assert not [f for f in kept.toolpath.findings if f.code == "between-locations"]


def test_passes_that_may_begin_elsewhere_are_replanned_where_they_begin(ring, short):
    kept = fx.optimise(ring, short, free_start=True, **RING)
    assert counts(kept, RING) == {}
    assert [f.code for f in kept.toolpath.findings].count("free-start") == 1


@pytest.mark.slow
def test_rewound_paths_are_replanned_too(ring, short):
    """C turns by 370 deg at most: two rounds take a rewind, and Z has to be kept inside all along."""
    c = short.column("C")
    limits = Limits(np.radians(-185.0), np.radians(185.0))
    axes = [replace(a, limits=limits) if i == c else a for i, a in enumerate(short.axes)]
    machine = replace(short, axes=tuple(axes))
    twice = ring.at(np.concatenate([np.arange(0, 121, 3), np.arange(3, 121, 3)]))
    blind = optimise(twice, machine, **RING)
    assert counts(blind, RING)["axis-limit"] > 0
    kept = fx.optimise(twice, machine, **RING)
    assert kept.wound is not None
    assert "axis-limit" not in counts(kept, RING)


def test_one_location_has_nothing_between(ring, hayashi):
    assert len(fx.optimise(ring.at(np.array([3])), hayashi, **RING).motion) == 1
