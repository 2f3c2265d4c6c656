"""Every file that a job is made from."""

from fiveaxis.job import read_job
from fiveaxis.job.loading import describe_inputs

PATH = "x,y,z,nx,ny,nz\n10,0,0,1,0,0\n10,1,0,1,0,0\n"
FILES = {
    "ring.csv": PATH,
    "tool.toml": 'shape = "ball"\ndiameter = 8\n',
    "mine.toml": 'based_on = "other.toml"\nlongest = 90\n',
    "other.toml": 'based_on = "linuxcnc"\nlongest = 100\n',
    "clamp.stl": "solid\nendsolid\n",
    "job.toml": 'input = "ring.csv"\nmachine = "hayashi-640123"\ndrives = "takisawa-mac-v3"\n'
    'tool = "tool.toml"\n'
    'control = "mine.toml"\n[[fixture]]\nname = "clamp"\nmesh = "clamp.stl"\n',
}


def test_each_file_of_a_job_is_described_once_with_its_uses(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    found = describe_inputs(read_job(tmp_path / "job.toml", part=tmp_path / "ring.csv"))
    assert {f["name"]: f["used_as"] for f in found} == {
        "job.toml": "job",
        "ring.csv": "input, part",
        "clamp.stl": "fixture.0",
        "tool.toml": "tool",
        "mine.toml": "control",
        "other.toml": "control",
        "hayashi-640123.toml": "machine.file",
        "takisawa-mac-v3.toml": "drives.file",
    }
    assert all(len(f["sha256"]) == 64 for f in found)
