"""Every room says what it does: the gist for -v, the details for -vv, both through its own loggers."""

import logging
from types import SimpleNamespace
from urllib.request import urlopen

import numpy as np
import pytest
import trimesh

from fiveaxis.job import make_job, run_job
from fiveaxis.lab import calibrate_drive
from fiveaxis.nc import write_motion
from fiveaxis.show import preview, write_preview, write_report

TOOL = """
shape = "ball"
diameter = 8
shank_diameter = 7
[holder]
stick_out = 25
sections = [{length = 40, diameter = 40}]
"""


class Kept(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.records: list[logging.LogRecord] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.records.append(record)

    def of(self, room: str, level: int) -> str:
        """Give a room's messages of one level, a line each."""
        own = (r for r in self.records if room in r.name.split(".") and r.levelno == level)
        return "\n".join(record.getMessage() for record in own)


@pytest.fixture(scope="module")
def told(tmp_path_factory) -> Kept:
    """What a job on five points of a floor, with a holder and a part, says."""
    folder, kept = tmp_path_factory.mktemp("told"), Kept()
    box = trimesh.creation.box(extents=(40.0, 40.0, 10.0))
    box.apply_translation([0.0, 0.0, -5.0])
    box.export(folder / "part.stl")
    (folder / "tool.toml").write_text(TOOL)
    (folder / "path.csv").write_text("x,y,z,nx,ny,nz\n" + "".join(f"{x},0,0,0,0,1\n" for x in range(5)))
    logger = logging.getLogger("fiveaxis")
    before = logger.level
    logger.setLevel(logging.DEBUG)
    logger.addHandler(kept)
    try:
        job = make_job(
            input=folder / "path.csv",
            machine="hayashi-640123",
            tool=str(folder / "tool.toml"),
            tilt=(15, 75),
            effort="quick",
            part=folder / "part.stl",
        )
        outcome = run_job(job)
        write_motion(outcome.solution.motion, folder / "motion.csv", outcome.solution.machine)
    finally:
        logger.removeHandler(kept)
        logger.setLevel(before)
    return kept


@pytest.mark.parametrize(
    ("room", "gist", "detail"),
    [
        ("nc", "path.csv: 5 locations", ""),
        ("nc", "motion.csv: 5 locations, axes X Y Z A C", ""),
        (
            "collision",
            "postures of 5 locations are kept clear of part",
            "part is tested against shank, holder",
        ),
        ("collision", "", "holder against part: 5 of 5 locations and the moves to them; 0 overlap, 0 come"),
        ("verification", "5 locations on hayashi-640123: found nothing", "checked: "),
        ("verification", "pairs of bodies along 5 locations: ", "not checked: "),
        ("lab", "without ", "feed drives: "),
    ],
)
def test_a_room_says_what_it_did(told, room, gist, detail):
    assert gist in told.of(room, logging.INFO)
    assert detail in told.of(room, logging.DEBUG)


def test_every_room_of_a_job_logs_under_its_own_name(told):
    rooms = {part for record in told.records for part in record.name.split(".")}
    assert rooms >= {"nc", "collision", "posture", "verification", "lab"}


def test_the_report_says_how_large_its_page_is(tmp_path, caplog, monkeypatch):
    monkeypatch.setattr("fiveaxis.show.report.page.compose_page", lambda *_: "x" * 2000)
    with caplog.at_level(logging.INFO, logger="fiveaxis.show.report"):
        write_report(SimpleNamespace(locations=5), tmp_path / "report.html")
    assert caplog.messages == ["report.html: 2 kB about 5 locations"]


def test_the_viewer_says_where_it_is_seen_and_who_looks(tmp_path, caplog, monkeypatch):
    for module in ("page", "serving"):
        monkeypatch.setattr(f"fiveaxis.show.viewer.{module}.render_page", lambda *_, **__: "x" * 2000)
    with caplog.at_level(logging.DEBUG, logger="fiveaxis.show.viewer"):
        write_preview(None, tmp_path / "preview.html")
        with preview(None, open_browser=False) as shown, urlopen(shown.url()) as page:
            page.read()
        address = shown.url()
    assert caplog.messages[:2] == ["preview.html: 2 kB", f"2 kB at {address}"]
    assert caplog.messages[2].startswith('"GET / HTTP/1.1" 200')


def test_a_calibration_says_what_it_fits_and_what_it_drops(tmp_path, caplog):
    time = np.arange(0.0, 4.0, 0.01)
    speed = 20.0 * np.sin(2.0 * time)
    power = 5.0 + 0.4 * np.abs(speed)
    rows = np.column_stack([time, speed, power])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t,v,p", comments="")
    with caplog.at_level(logging.DEBUG, logger="fiveaxis.lab"):
        columns = {"power": "p", "velocity": "v", "time": "t"}
        units = {"power_unit": "W", "velocity_unit": "mm/s", "time_unit": "s"}
        calibrate_drive(
            tmp_path / "log.csv", axis="X", model="friction", max_acceleration=35.0, **columns, **units
        )
    assert "log.csv: friction model to " in caplog.text
    assert "dropped " in caplog.text
