"""A short soak; `tests/benchmarks/soak.py` is the long one."""

import sys

import pytest
from soaking.killing import compare, soak
from soaking.rings import write_ring_jobs

from fiveaxis.job import run_batch


@pytest.mark.skipif(sys.platform == "win32", reason="a process can't be killed like that there")
@pytest.mark.slow
def test_workers_and_commands_killed_at_random_moments_change_no_byte_of_the_results(tmp_path):
    files = write_ring_jobs(tmp_path / "jobs", 2)
    run_batch(files, tmp_path / "quiet", workers=1)
    tally = soak(files, tmp_path / "out", kinds=["running", "batch"], seed=1, workers=1)
    assert compare(tally, files, tmp_path / "out", tmp_path / "quiet").is_clean, tally
    assert tally.kills.total() == 2, tally
