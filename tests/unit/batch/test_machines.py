"""One job on several machines: the rows, and what is claimed of a winner."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from fiveaxis.batch import Candidate, MachineComparison, Row, Status, compare_machines
from fiveaxis.cli import app
from fiveaxis.errors import SettingError

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
    assert compared(*known).claims[1].startswith("quick is quickest: 99 to 101 s")
    unknown = [candidate("quick", (90.0, 110.0), "programmed"), known[1]]
    assert "max_acceleration" in compared(*unknown).claims[1]


def test_a_machine_that_cant_is_no_rival_and_one_that_can_is_enough():
    can, cannot = candidate("can", (1.0, 2.0)), candidate("cannot", (0.1, 0.2), status=Status.ERRORS)
    done = compared(can, cannot)
    assert done.claims[0] == "Only can can run it."
    assert done.exit_code == 0
    assert compared(cannot).exit_code == 1
    none, wrong = (candidate(s.name, (0.1, 0.2), status=s) for s in (Status.NO_POSTURE, Status.WRONG_INPUT))
    # From bad to worse, as of a batch.
    assert compared(none, wrong).exit_code == 3
    assert "No machine" in compared(cannot).claims[0]


def test_every_machine_has_a_row_with_its_reason_and_no_duplicates(write_job, pretended, tmp_path):
    job = write_job("cup")
    names = ["hayashi-640123", "dmu50ev", "hayashi-640123", "nosuch"]
    done = compare_machines(job, names, tmp_path / "out", workers=1)
    ends = {c.machine: str(c.row.status) for c in done.candidates}
    assert ends == {"hayashi-640123": "fine", "dmu50ev": "fine", "nosuch": "wrong input"}
    assert "nosuch" in done.candidates[-1].row.message
    assert done.candidates[0].energy == pytest.approx((900.0, 1200.0))
    assert "isn't known" in done.claims[0]


def test_one_machine_is_nothing_to_compare(write_job, pretended, tmp_path):
    with pytest.raises(SettingError, match="at least two"):
        compare_machines(write_job("cup"), ["dmu50ev"], tmp_path / "out")


@pytest.mark.slow
def test_the_verb_compares_real_programs(write_job, tmp_path):
    job = write_job("cup", 'tilt = [15, 75]\neffort = "quick"\ntool_length = 100\n')
    given = "hayashi-640123,dmu50ev,umc-750,takisawa-mac-v3"
    words = ["compare", str(job), "--machines", given, "-o", str(tmp_path / "out"), "--json"]
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
