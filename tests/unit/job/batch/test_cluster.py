"""Batches on a dask scheduler that is there already."""

import subprocess
import sys

import pytest
from soaking.rings import contents

from fiveaxis.base.errors import SettingError
from fiveaxis.job import run_batch
from fiveaxis.job.batch.cluster import require_scheduler, run_remotely
from fiveaxis.job.batch.tasks import QueuedJob

distributed = pytest.importorskip("distributed")
posix = pytest.mark.skipif(sys.platform == "win32", reason="no openssl there")


def test_a_scheduler_that_doesnt_answer_is_named(monkeypatch, in_time):
    monkeypatch.setattr("fiveaxis.job.batch.cluster.ANSWER", 0.5)
    with pytest.raises(SettingError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9 .*dask scheduler"):
        in_time(lambda: require_scheduler("tcp://127.0.0.1:9"))


@pytest.mark.parametrize("address", ["nonsense", "tls://127.0.0.1:9"])
def test_an_address_that_is_none_or_needs_certificates_is_named(address):
    with pytest.raises(SettingError, match=f"no scheduler answers at {address}"):
        require_scheduler(address)


def test_a_worker_of_another_version_is_reported(jobs, tmp_path):
    row = run_remotely(QueuedJob("a", jobs[0]), str(tmp_path), "99.0", "a topic")
    assert row["status"] == "broken"
    assert "this command 99.0; install one everywhere" in row["message"]


@pytest.fixture
def certificate(tmp_path):
    """A certificate, and what a scheduler and its clients have to have of it."""
    key, pem = tmp_path / "key.pem", tmp_path / "cert.pem"
    words = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=fiveaxis"]
    subprocess.run(["openssl", *words, "-keyout", key, "-out", pem], check=True, capture_output=True)
    return {
        "distributed.comm.tls.ca-file": str(pem),
        "distributed.comm.require-encryption": True,
        **{f"distributed.comm.tls.{role}.cert": str(pem) for role in ("client", "scheduler", "worker")},
        **{f"distributed.comm.tls.{role}.key": str(key) for role in ("client", "scheduler", "worker")},
    }


@posix
def test_jobs_run_on_a_scheduler_with_certificates_which_a_client_without_is_refused(
    certificate, jobs, pretended, tmp_path, monkeypatch, in_time
):
    dask = pytest.importorskip("dask")
    with dask.config.set(certificate):
        there = distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            protocol="tls",
            host="127.0.0.1",
            security=distributed.Security(),
            dashboard_address="127.0.0.1:0",
        )
    with there:
        address = there.scheduler_address
        assert address.startswith("tls://")
        with monkeypatch.context() as patch:
            patch.setattr("fiveaxis.job.batch.cluster.ANSWER", 1.0)
            for stranger in (address, address.replace("tls://", "tcp://")):
                with pytest.raises(SettingError, match="no scheduler answers"):
                    in_time(lambda to=stranger: run_batch(jobs, tmp_path / "none", scheduler=to))
        assert not (tmp_path / "none").exists()
        with dask.config.set(certificate):
            far = in_time(lambda: run_batch(jobs, tmp_path / "far", scheduler=address))
    assert sorted(pretended.ran) == [f"path_{name}.csv" for name in "abcd"]
    assert far.as_dict() == run_batch(jobs, tmp_path / "near", workers=2).as_dict()
    assert contents(tmp_path / "far") == contents(tmp_path / "near")
