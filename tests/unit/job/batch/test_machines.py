"""One job on several machines: the rows, and what is claimed of a winner."""

import importlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from fiveaxis.base.errors import JobError, MachineError, SettingError
from fiveaxis.cli.commands import app
from fiveaxis.job import MachineComparison, Row, compare, read_job
from fiveaxis.job.batch.machines import Candidate
from fiveaxis.job.batch.record import Status
from fiveaxis.lab import Factors
from fiveaxis.model import machine_text

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
RANGE = st.tuples(st.floats(1.0, 1e3), st.floats(0.0, 1e3)).map(lambda pair: (pair[0], pair[0] + pair[1]))


def candidate(name, span, basis="accelerations", status=Status.FINE):
    middle = sum(span) / 2.0
    values = {"machine": name}
    spent = {"energy": middle, "energy_least": span[0], "energy_most": span[1]}
    row = Row(name, "job.toml", status, values=values, time=middle, **spent)
    return Candidate(row, {"time_basis": basis})


def compared(*candidates):
    return MachineComparison("job", candidates, None)


@given(st.lists(RANGE, min_size=2, max_size=5), st.integers(0, 2**32 - 1))
def test_a_winner_that_is_named_wins_wherever_the_true_energies_lie(spans, seed):
    names = [f"m{number}" for number in range(len(spans))]
    cheapest = compared(*map(candidate, names, spans)).claims[0]
    draw = np.random.default_rng(seed)
    true = [draw.uniform(*span) for span in spans]
    winner = names[int(np.argmin(true))]
    assert cheapest.startswith(f"{winner} is cheapest for the feed drives") or "isn't known" in cheapest
    apart = sorted(spans)
    assert ("isn't known" in cheapest) == (apart[0][1] >= apart[1][0])


def test_times_without_accelerations_have_no_upper_end():
    known = [candidate(name, span) for name, span in (("quick", (90.0, 110.0)), ("slow", (190.0, 210.0)))]
    assert compared(*known).claims[-1].startswith("quick is quickest: 99 to 101 s")
    unknown = [candidate("quick", (90.0, 110.0), "programmed"), known[1]]
    assert "max_acceleration" in compared(*unknown).claims[-1]


def test_a_machine_that_cant_is_no_rival_and_one_that_can_is_enough():
    can, cannot = candidate("can", (1.0, 2.0)), candidate("cannot", (0.1, 0.2), status=Status.ERRORS)
    done = compared(can, cannot)
    assert done.claims[0] == "Only can has a released program."
    assert done.exit_code == 0
    assert compared(cannot).exit_code == 1
    none, wrong = (candidate(s.name, (0.1, 0.2), status=s) for s in (Status.NO_POSTURE, Status.WRONG_INPUT))
    # From bad to worse, as of a batch.
    assert compared(none, wrong).exit_code == 3
    assert "No machine" in compared(cannot).claims[0]


def test_a_misspelt_machine_is_one_error_before_anything_runs(write_job, tmp_path):
    with pytest.raises(MachineError, match="unknown machine 'dmu50'; did you mean dmu50ev"):
        compare(write_job("cup"), ["hayashi-640123", "dmu50"], tmp_path / "out")
    with pytest.raises(JobError, match=r"cap\.toml: no such file"):
        compare(tmp_path / "cap.toml", ["hayashi-640123", "dmu50ev"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_every_machine_has_a_row_with_its_reason_and_no_duplicates(write_job, pretended, tmp_path):
    job = write_job("cup")
    names = ["hayashi-640123", "dmu50ev", "hayashi-640123"]
    done = compare(job, names, tmp_path / "out", workers=1)
    ends = {c.machine: str(c.row.status) for c in done.candidates}
    assert ends == {"hayashi-640123": "fine", "dmu50ev": "fine"}
    assert done.candidates[0].energy == pytest.approx((900.0, 1200.0))
    assert "measure the power of X on" in done.claims[0]
    assert done.candidates[0].row.values["setup.search"]["auto"]
    page = (tmp_path / "out/machines.html").read_text()
    assert all(words in page for words in ("X0 Y0 Z0", "X 100.0 mm"))
    again = read_job(tmp_path / "out/cup/machine=dmu50ev/job.toml")
    assert (again.machine, again.setup.offset, again.setup.search) == ("dmu50ev", (0.0, 0.0, 0.0), None)


def test_a_part_that_stays_isnt_searched_for_and_a_jobs_own_ranges_are_kept(write_job, pretended, tmp_path):
    ranged = write_job("cup", "tilt = [15, 75]\nsetup.search.x = [-5, 5]\n")
    names = ["hayashi-640123", "dmu50ev"]
    assert "setup.search" not in compare(ranged, names, tmp_path / "a").candidates[0].row.values
    stays = compare(ranged, names, tmp_path / "b", as_placed=True).candidates[0].row.values
    assert stays["setup.search"] is None


def test_prices_that_are_given_replace_the_jobs(write_job, pretended, tmp_path):
    job = write_job("cup", 'tilt = [15, 75]\nfactors = { price = 3.6, co2 = 0.36, source = "the bill" }\n')
    done = compare(job, ["hayashi-640123", "dmu50ev"], tmp_path / "out", hour=3600.0)
    figures = done.candidates[0].figures
    assert figures["cost"] == pytest.approx(1000.0 * 1e-6 + 9.5)
    assert figures["co2_kg"] == pytest.approx(1e-4)
    # What isn't known of energy and time isn't known of the cost.
    assert done.candidates[0].cost == (pytest.approx(900.0 * 1e-6 + 9.5, rel=0.01), np.inf)
    assert "cheapest in money isn't known" in done.claims[-1]
    assert json.loads(json.dumps(done.as_dict()))["machines"][0]["cost_range"][1] is None


def test_a_cheapest_machine_is_named_where_its_cost_ends_before_the_next_ones_begins():
    prices = Factors(hour=3600.0, currency="EUR")
    quick, slow = candidate("quick", (10.0, 20.0)), candidate("slow", (10.0, 20.0))
    rivals = [
        Candidate(replace(c.row, time=time), {**c.figures, "cost": time, "all_J": c.row.energy}, {}, prices)
        for c, time in ((quick, 10.0), (slow, 10.5))
    ]
    assert rivals[0].cost == pytest.approx((9.94, 10.06))
    claim = compared(*rivals).claims[-1]
    assert claim.startswith("quick is cheapest in money: 9.94 to 10.1 EUR, and the next one, slow, takes")


def test_two_machines_of_one_name_are_refused(write_job, tmp_path):
    files = [tmp_path / folder / "mill.toml" for folder in "ab"]
    for file in files:
        file.parent.mkdir()
        file.write_text("")
    with pytest.raises(SettingError, match=r"a/mill\.toml and .*b/mill\.toml are both called 'mill'; rename"):
        compare(write_job("cup"), files, tmp_path / "out")


def test_a_base_power_that_isnt_stated_may_be_any():
    frugal, other = candidate("frugal", (10.0, 20.0)), candidate("other", (30.0, 40.0))
    assert "base power of frugal, other and state it" in compared(frugal, other).claims[1]
    stated = Candidate(replace(frugal.row, base=5.0), frugal.figures)
    assert stated.with_base == pytest.approx((14.97, 25.03))
    assert compared(stated, other).claims[1].startswith("frugal is cheapest with base power: 15 to 25 J")


def test_as_long_as_a_time_is_open_so_is_the_energy_over_it():
    rivals = [candidate("open", (10.0, 20.0), "programmed"), candidate("known", (15.0, 16.0))]
    for base in (0.0, 50.0):
        stated = [Candidate(replace(c.row, base=base), c.figures) for c in rivals]
        assert stated[0].with_base[1] == np.inf
        assert "state max_acceleration of the axes of open" in compared(*stated).claims[1]


def test_a_machine_that_another_always_beats_is_no_rival():
    wide, narrow, beaten = (candidate(n, s) for n, s in zip("abc", [(1, 10), (2, 3), (5, 9.5)], strict=True))
    names = [c.machine for c in compared(wide, narrow, beaten).contenders(lambda c: c.energy)]
    assert names == ["a", "b"]


@pytest.mark.parametrize("coordinates", ["axes", "tip"])
def test_a_machine_whose_control_has_no_tcp_writes_axes_or_says_why_it_cant(
    coordinates, hayashi, writing, tmp_path
):
    lacks = "it has no TCP; write axes"
    (tmp_path / "plain.toml").write_text(f'based_on = "fanuc"\nrefused = {{ tip = "{lacks}" }}\n')
    files = {"old": str(tmp_path / "plain.toml"), "new": "fanuc"}
    for name, control in files.items():
        text = machine_text(replace(hayashi, name=name, control=control))
        (tmp_path / f"{name}.toml").write_text(text)
    asked = f'effort = "quick"\nfeed = 500\ncoordinates = "{coordinates}"\n'
    job = writing(tmp_path, "job", f"tilt = [15, 75]\n{asked}")
    done = compare(job, [tmp_path / f"{n}.toml" for n in files], tmp_path / "out", as_placed=True, workers=1)
    rows = {candidate.machine: candidate for candidate in done.candidates}
    assert rows["new"].can
    if coordinates == "axes":
        assert rows["old"].can
        program = next((tmp_path / "out" / rows["old"].row.name).glob("program.*")).read_text()
        assert "G93" in program
        assert "G43.4" not in program
    else:
        reason = f"control 'plain' isn't written in coordinates 'tip': {lacks}"
        assert rows["old"].row.message.endswith(reason)


def test_one_machine_is_nothing_to_compare(write_job, pretended, tmp_path):
    with pytest.raises(SettingError, match="at least two"):
        compare(write_job("cup"), ["dmu50ev"], tmp_path / "out")


@pytest.mark.slow
def test_the_cheapest_of_machines_drawn_from_their_bands_is_claimed(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    draws = importlib.import_module("draws")
    for width, hits, names in draws.count(100, ("dmu50ev", "variaxis-630")):
        assert hits >= 95, (width, names)


@pytest.mark.slow
def test_the_verb_compares_real_programs(write_job, tmp_path):
    job = write_job("cup", 'tilt = [15, 75]\neffort = "quick"\ntool_length = 100\n')
    given = "hayashi-640123,dmu50ev,umc-750,takisawa-mac-v3"
    words = [
        "compare",
        str(job),
        "--machines",
        given,
        "-o",
        str(tmp_path / "out"),
        "--job-timeout",
        "900",
        "--json",
    ]
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 0, ended.output
    rows = {row["machine"]: row for row in json.loads(ended.stdout)["machines"]}
    assert rows["umc-750"]["status"] == "wrong input"
    assert "--assume" in rows["umc-750"]["reason"]
    assert "0 rotary axes" in rows["takisawa-mac-v3"]["reason"]
    for name in ("hayashi-640123", "dmu50ev"):
        low, high = rows[name]["energy_range_J"]
        assert low <= rows[name]["energy_J"] <= high
        assert rows[name]["largest_rotary_deg_s"] >= 0.0
