"""Logs as machines write them: stated units that are checked, uneven time, gaps, loads in percent."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import tzset
from typing import Any

import numpy as np
import pytest

from fiveaxis.base.errors import InputError, SettingError
from fiveaxis.lab import Calibration
from fiveaxis.lab.calibration.calibration import calibrate_drive

SLOPE, OFFSET = 1.2, 40.0  # W/(mm/s), W: of the drive in all logs here
COLUMNS = {"power": "P", "power_unit": "W", "velocity": "v", "velocity_unit": "mm/s"}
TIMED = COLUMNS | {"time": "t", "time_unit": "s"}


def swing(rows: int = 400, seed: int = 7) -> dict[str, np.ndarray]:
    """An axis at speeds up to 50 mm/s with steps of 5 to 15 ms, and its power."""
    time = np.cumsum(np.random.default_rng(seed).uniform(0.005, 0.015, rows))
    position = 60.0 * np.sin(time) - 2.0 * np.cos(5.0 * time)
    velocity = 60.0 * np.cos(time) + 10.0 * np.sin(5.0 * time)
    return {"t": time, "x": position, "v": velocity, "P": SLOPE * np.abs(velocity) + OFFSET}


def write(path: Path, columns: dict[str, Any]) -> Path:
    rows = zip(*columns.values(), strict=True)
    cells = [",".join(v if isinstance(v, str) else f"{v:.9g}" for v in row) for row in rows]
    path.write_text("\n".join([",".join(columns), *cells]) + "\n")
    return path


def affine(log: Any, **options: Any) -> Calibration:
    return calibrate_drive(log, axis="X", model="affine", **options)


def slope_of(found: Calibration) -> float:
    """W/(mm/s), mean of both directions."""
    values = {c.name: c.value for c in found.coefficients}
    return 60.0 * 0.5 * (values["plus slope"] + values["minus slope"])


@pytest.mark.parametrize(
    ("unit", "size"),
    [("mm/s", 1.0), ("mm/min", 60.0), ("m/min", 0.06), ("inch/min", 60.0 / 25.4), ("m/s", 1e-3)],
)
def test_the_drive_is_the_same_in_every_unit_of_the_speed(tmp_path, unit, size):
    columns = swing()
    log = write(tmp_path / "log.csv", columns | {"v": columns["v"] * size})
    found = affine(log, **COLUMNS | {"velocity_unit": unit})
    assert slope_of(found) == pytest.approx(SLOPE, rel=1e-4)


@pytest.mark.parametrize("missing", ["power", "velocity", "acceleration", "position", "time"])
def test_a_column_without_its_unit_is_refused_before_the_log_is_read(tmp_path, missing):
    options = {"power": "P", "velocity": "v", "acceleration": "a", "position": "x", "time": "t"}
    units = {"power": "W", "velocity": "mm/s", "acceleration": "mm/s2", "position": "mm", "time": "s"}
    stated = {f"{q}_unit": u for q, u in units.items() if q != missing}
    with pytest.raises(SettingError, match=rf"the {missing} has no unit; state the one of its column: "):
        affine(tmp_path / "none.csv", **options, **stated)


def test_a_unit_without_a_column_is_refused(tmp_path):
    with pytest.raises(SettingError, match=r"the position has a unit, mm, but no column"):
        affine(tmp_path / "none.csv", **COLUMNS, position_unit="mm")


@pytest.mark.parametrize(
    ("scale", "options", "message"),
    [
        (
            {"v": 60.0},
            {},
            r"velocity in column 'v' peaks at 4\d\d\d mm/s, above the 2000 .*likely unit is mm/min",
        ),
        ({"v": 1e-3}, {}, r"peaks at 0.06\d* mm/s, below the 0.1 mm/s .*likely unit is m/s \(not mm/s\)"),
        ({"P": 1e-3}, {}, r"power in column 'P' peaks at 0.1\d* W, below the 1 W .*likely unit is kW"),
        (
            {},
            {"power_unit": "kW"},
            r"peaks at 1\.\d+e\+05 W, above the 100000 W .*likely unit is W \(not kW\)",
        ),
        (
            {"t": 1000.0},
            {},
            r"time in column 't' has a median step of 10.* s, above the 5 s .*likely unit is ms \(not s\)",
        ),
        ({"P": 20.0}, {"power_unit": "%", "nominal_power": 1e3}, r"load in column 'P' peaks at \d+ %, above"),
    ],
    ids=["mm/min as mm/s", "m/s as mm/s", "kW as W", "W as kW", "ms as s", "load of 2 000 %"],
)
def test_a_peak_that_no_axis_reaches_is_refused_with_the_likely_unit(tmp_path, scale, options, message):
    columns = {name: values * scale.get(name, 1.0) for name, values in swing().items()}
    log = write(tmp_path / "log.csv", columns)
    with pytest.raises(InputError, match=message):
        affine(log, **TIMED | options)


def test_a_peak_speed_of_3000_mm_s_names_mm_min(tmp_path):
    speed = np.tile(np.linspace(-3000.0, 3000.0, 40), 3)
    log = write(tmp_path / "log.csv", {"v": speed, "P": 0.02 * np.abs(speed) + OFFSET})
    with pytest.raises(InputError) as caught:
        affine(log, **COLUMNS)
    assert str(caught.value) == (
        f"{log}: velocity in column 'v' peaks at 3000 mm/s, above the 2000 mm/s of machine tools; "
        "the likely unit is mm/min (not mm/s), which makes it 50 mm/s"
    )
    assert slope_of(affine(log, **COLUMNS | {"velocity_unit": "mm/min"})) == pytest.approx(1.2, rel=1e-3)


def test_a_single_wild_row_is_named_by_its_line_and_not_taken_for_the_unit(tmp_path):
    columns = swing()
    columns["v"][200] = 9e4
    log = write(tmp_path / "log.csv", columns)
    with pytest.raises(
        InputError, match=r"log.csv:202: .*9e\+04 mm/s.*in 1 of 400 rows; correct these cells"
    ):
        affine(log, **COLUMNS)


@pytest.mark.parametrize(
    ("stated", "size"), [("mm/s", 60.0), ("mm/min", 1.0), ("inch/s", 1.0), ("mm/s", 1 / 25.4)]
)
def test_a_speed_that_contradicts_the_position_is_refused_with_the_likely_unit(tmp_path, stated, size):
    """Ten times slower, so that every unit is plausible by its peak."""
    columns = swing(2000)
    slow = {"t": 10.0 * columns["t"], "v": 0.1 * size * columns["v"], "x": columns["x"], "P": columns["P"]}
    log = write(tmp_path / "log.csv", slow)
    real = {60.0: "mm/min", 1.0: "mm/s", 1 / 25.4: "inch/s"}[size]
    position = {"position": "x", "position_unit": "mm"}
    with pytest.raises(InputError, match=rf"likely unit of the velocity is {real}, not {stated}"):
        affine(log, **TIMED | {"velocity_unit": stated}, **position)
    assert not affine(log, **TIMED | {"velocity_unit": real}, **position).gaps


def test_a_position_of_another_axis_is_refused(tmp_path):
    log = write(tmp_path / "log.csv", swing() | {"x": np.full(400, 12.0)})
    with pytest.raises(
        InputError, match=r"travels 0 times what its velocity gives; check the columns and units"
    ):
        affine(log, **TIMED, position="x", position_unit="mm")


def test_a_speed_is_checked_by_the_position_in_a_log_with_a_long_gap(tmp_path):
    columns = swing(2000)
    columns["t"] += 1000.0 * (np.arange(2000) >= 1000)
    log = write(tmp_path / "log.csv", columns | {"v": 0.1 * columns["v"]})
    with pytest.raises(InputError, match=r"travels 10 times"):
        affine(log, **TIMED, position="x", position_unit="mm")


def test_a_speed_of_the_other_sign_is_refused(tmp_path):
    columns = swing()
    log = write(tmp_path / "log.csv", columns | {"v": -columns["v"]})
    with pytest.raises(InputError, match="position falls while velocity is positive"):
        affine(log, **TIMED, position="x", position_unit="mm")


@pytest.mark.parametrize("unit", ["ms", "us", "min", "iso"])
def test_time_is_read_in_its_unit(tmp_path, unit):
    columns = swing(2000)
    start = datetime(2026, 3, 29, 0, 59, 58, tzinfo=UTC)
    size = {"ms": 1e3, "us": 1e6, "min": 1.0 / 60.0}.get(unit)
    time = (
        [(start + timedelta(seconds=t)).isoformat().replace("+00:00", "Z") for t in columns["t"]]
        if size is None
        else columns["t"] * size
    )
    log = write(tmp_path / "log.csv", {"t": time, "x": columns["x"], "P": columns["P"]})
    found = affine(log, power="P", power_unit="W", position="x", position_unit="mm", time="t", time_unit=unit)
    assert slope_of(found) == pytest.approx(SLOPE, rel=0.01)


def test_dates_that_are_not_stated_are_refused_with_their_unit(tmp_path):
    log = write(tmp_path / "log.csv", {"t": ["2026-01-31T12:00:00Z"] * 30, "v": range(30), "P": range(30)})
    with pytest.raises(
        InputError, match=r":2: t is .*not a number; for dates and times the time unit is iso"
    ):
        affine(log, **TIMED)


def test_nothing_is_differentiated_across_a_gap_and_gaps_are_counted(tmp_path):
    """An axis that was moved elsewhere while nobody logged: its jump isn't a speed."""
    columns = swing(1200)
    after = np.arange(1200) >= 600
    columns["t"], columns["x"] = columns["t"] + 100.0 * after, columns["x"] + 300.0 * after
    log = write(tmp_path / "log.csv", {name: columns[name] for name in "txP"})
    options = {"power": "P", "power_unit": "W", "time": "t", "time_unit": "s"}
    found = affine(log, **options, position="x", position_unit="mm")
    assert slope_of(found) == pytest.approx(SLOPE, rel=0.01)
    ((reason, count),) = found.gaps.items()
    assert count == 1
    assert reason.startswith("steps longer than 0.")
    assert reason.endswith("100 s in all")
    assert np.abs(found.speed).max() < 75.0


def test_the_longest_step_is_a_setting(tmp_path):
    log = write(tmp_path / "log.csv", swing())
    assert not affine(log, **TIMED).gaps
    ((reason, count),) = affine(log, **TIMED, longest_step=0.0145).gaps.items()
    assert count > 5
    assert "longer than 0.0145 s" in reason


def test_a_row_alone_between_gaps_is_dropped_and_counted(tmp_path):
    columns = swing()
    columns["t"] += 50.0 * (np.arange(400) >= 200) + 50.0 * (np.arange(400) >= 201)
    log = write(tmp_path / "log.csv", columns)
    found = affine(log, **TIMED)
    assert found.dropped["alone between gaps"] == 1


def test_missing_rows_show_in_the_position(tmp_path):
    """Rows numbered by a rate although some are missing: the position jumps."""
    columns = swing(3000)
    time = np.arange(3000) * 0.01
    columns["x"], columns["v"] = 60.0 * np.sin(time), 60.0 * np.cos(time)
    columns["P"] = SLOPE * np.abs(columns["v"]) + OFFSET
    kept = (np.arange(3000) % 500) < 400
    log = write(tmp_path / "log.csv", {name: columns[name][kept] for name in "xvP"})
    found = affine(log, **COLUMNS, position="x", position_unit="mm", rate=100.0)
    assert found.gaps == {"jumps of position that the velocity doesn't explain": 5}


def percent(path: Path) -> Path:
    """X of a mill-turn centre as its control reports it: whole percent, 36 standing, 40 moving."""
    rng = np.random.default_rng(3)
    phase = np.arange(600) // 50 % 3
    velocity = np.where(phase == 0, 0.0, np.where(phase == 1, 1.0, -1.0) * rng.uniform(20.0, 200.0, 600))
    load = np.round(np.where(velocity == 0.0, 36.0, 40.0) + rng.normal(0.0, 0.8, 600))
    return write(path, {"t": np.arange(600) * 0.1, "v": velocity, "load": load})


LOAD = TIMED | {"power": "load", "power_unit": "%"}


def test_a_load_without_a_nominal_value_gives_shares_and_no_drive(tmp_path):
    log = percent(tmp_path / "x.csv")
    with pytest.raises(InputError) as caught:
        calibrate_drive(log, axis="X", model="directional", **LOAD)
    assert str(caught.value) == (
        f"{log}: the load is 36 % standing (median of 200 rows) and 40 % moving (median of 400 rows); which "
        "power 100 % are isn't known: give the nominal power, or the nominal current and the voltage"
    )


@pytest.mark.parametrize("nominal", [{"nominal_power": 2000.0}, {"nominal_current": 5.0, "voltage": 400.0}])
def test_a_load_of_a_nominal_power_is_that_power_and_standing_is_a_term(tmp_path, nominal):
    log = percent(tmp_path / "x.csv")
    found = calibrate_drive(log, axis="X", model="directional", **LOAD, **nominal)
    values = {c.name: c.value for c in found.coefficients}
    assert values["standing"] == pytest.approx(720.0, abs=5.0)
    assert (values["plus"], values["minus"]) == pytest.approx((80.0, 80.0), abs=6.0)
    assert (found.standstill_power, found.moving_power, found.nominal) == (720.0, 800.0, 2000.0)
    assert "load of 2000 W, without sign: braking counts as pushing" in found.block
    assert "at standstill, fitted to 200 rows, aren't in this drive" in found.block


def test_a_current_at_a_voltage_is_a_power(tmp_path):
    columns = swing()
    log = write(tmp_path / "log.csv", columns | {"P": columns["P"] / 48.0})
    found = affine(log, **COLUMNS | {"power_unit": "A"}, voltage=48.0)
    assert slope_of(found) == pytest.approx(SLOPE, rel=1e-4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"nominal_power": 900.0}, r"a power in W needs no nominal value; given: nominal power"),
        ({"power_unit": "A"}, r"a power in A needs voltage; given: none"),
        (
            {"power_unit": "%", "voltage": 400.0},
            r"in % needs nominal power or nominal current and voltage; given: voltage",
        ),
        (
            {"power_unit": "%", "nominal_power": 0.0},
            r"nominal_power = 0 W is out of range; give more than 0 W",
        ),
        ({"longest_step": 0.0, "rate": 10.0}, r"longest_step = 0 s is out of range"),
    ],
)
def test_nominal_values_must_fit_the_unit_of_the_power(tmp_path, options, message):
    with pytest.raises(SettingError, match=message):
        affine(tmp_path / "none.csv", **COLUMNS | options)


def test_a_power_without_sign_shows_no_regeneration(tmp_path):
    options = {"axis": "X", "model": "friction", "moved_mass": 9.0, "terms": ["friction", "regeneration"]}
    with pytest.raises(SettingError, match=r"a power in % has no sign and doesn't show regeneration"):
        calibrate_drive(tmp_path / "none.csv", **LOAD, nominal_power=1e3, **options)


def runs(folder: Path, slopes: list[float]) -> list[Path]:
    logs = []
    for i, slope in enumerate(slopes):
        columns = swing(seed=i)
        power = slope * np.abs(columns["v"]) + OFFSET
        logs.append(write(folder / f"run{i}.csv", columns | {"P": power}))
    return logs


def test_a_held_out_run_is_priced_but_not_fitted(tmp_path):
    first, second = runs(tmp_path, [SLOPE, 2.0 * SLOPE])
    found = affine(first, **TIMED, hold_out=[second])
    assert slope_of(found) == pytest.approx(SLOPE, rel=1e-4)
    fitted, held = found.runs
    assert (fitted.name, fitted.held_out) == ("run0.csv", False)
    assert (held.name, held.held_out) == ("run1.csv", True)
    # One row at standstill is too few for a term, and the drive takes nothing in it.
    assert fitted.error == pytest.approx(0.0, abs=2e-3)
    time, columns = swing(seed=1)["t"], swing(seed=1)
    drawn = np.trapezoid(2.0 * SLOPE * np.abs(columns["v"]) + OFFSET, time)
    given = np.trapezoid(SLOPE * np.abs(columns["v"]) + OFFSET, time)
    # The first and the last row stand for half a usual step more.
    assert held.measured == pytest.approx(drawn, rel=0.01)
    assert held.error == pytest.approx(given / drawn - 1.0, abs=3e-3)
    assert found.held_out_error == held.error
    assert held.r_squared < 1.0


def test_of_several_logs_each_is_held_out_in_turn_and_all_are_fitted(tmp_path):
    logs = runs(tmp_path, [SLOPE, SLOPE, 1.1 * SLOPE])
    found = affine(logs, **TIMED)
    assert found.rows + sum(found.dropped.values()) == 1200
    assert [run.held_out for run in found.runs] == [True, True, True]
    assert found.runs[2].error < -0.02
    assert "run0.csv (sha256 " in found.source
    assert "; run2.csv (sha256 " in found.source


def test_energy_over_uneven_steps_is_that_of_even_ones(tmp_path):
    """The same motion, logged in steps that differ by a factor of three, with a third of the rows lost."""
    even = np.arange(0.0, 20.0, 0.01)
    uneven = np.cumsum(np.random.default_rng(5).uniform(0.005, 0.015, 2200))
    uneven = uneven[uneven < 20.0]
    uneven = uneven[np.random.default_rng(6).random(len(uneven)) > 0.3]
    logs = []
    for name, time in (("even", even), ("uneven", uneven)):
        speed = 60.0 * np.cos(time)
        power = SLOPE * np.abs(speed) + OFFSET
        logs.append(write(tmp_path / f"{name}.csv", {"t": time, "v": speed, "P": power}))
    found = affine(logs[0], **TIMED, hold_out=[logs[1]])
    first, second = found.runs
    assert second.measured == pytest.approx(first.measured, rel=2e-3)
    assert second.time == pytest.approx(first.time, rel=2e-3)


def test_runs_are_different_logs_with_a_time(tmp_path):
    first, second = runs(tmp_path, [SLOPE, SLOPE])
    with pytest.raises(SettingError, match=r"run0.csv is given twice; fit it or hold it out"):
        affine(first, **TIMED, hold_out=[first])
    with pytest.raises(SettingError, match=r"the energy of several runs needs the time"):
        affine([first, second], **COLUMNS)


def standstill(path: Path, power: float = OFFSET + 5.0) -> Path:
    """A log of an axis that stands, with the noise of its scale."""
    rng = np.random.default_rng(8)
    noise = {"x": 1e-3 * rng.standard_normal(200), "v": 0.02 * rng.standard_normal(200)}
    return write(path, {"t": np.arange(200) * 0.01, **noise, "P": power + 0.1 * rng.standard_normal(200)})


def test_the_standstill_may_be_a_log_of_its_own_and_is_held_out_of_nothing(tmp_path):
    (moving,) = runs(tmp_path, [SLOPE])
    columns = {"position": "x", "position_unit": "mm"}
    found = affine([moving, standstill(tmp_path / "rest.csv", 15.0)], **TIMED, **columns)
    values = {c.name: c.value for c in found.coefficients}
    assert values["standing"] == pytest.approx(15.0, abs=0.1)
    assert values["plus offset"] == pytest.approx(OFFSET - 15.0, abs=0.2)
    assert found.runs == ()


def test_a_run_that_the_others_need_is_named(tmp_path):
    first, second = runs(tmp_path, [SLOPE, SLOPE])
    short = tmp_path / "short.csv"
    short.write_text("\n".join(second.read_text().splitlines()[:20]) + "\n")
    with pytest.raises(
        InputError, match=r"are too few .*\(without run0.csv, held out in turn; name the runs"
    ):
        affine([first, short], **TIMED)
    assert affine(first, **TIMED, hold_out=short).runs[1].rows == 19


def test_the_block_says_how_well_the_drive_gives_held_out_runs(tmp_path):
    first, second = runs(tmp_path, [SLOPE, 2.0 * SLOPE])
    found = affine(first, **TIMED, hold_out=[second])
    assert f"energy of held-out logs (1): {found.held_out_error:+.1%}" in found.block


def test_a_rotary_axis_is_read_in_its_units(tmp_path):
    time = np.arange(2000) * 0.01
    turns = 10.0 * np.sin(time)  # rev/min
    power = 3.0 * np.abs(turns) + OFFSET
    log = write(tmp_path / "c.csv", {"t": time, "v": turns, "P": power})
    options = TIMED | {"velocity_unit": "rev/min"}
    found = calibrate_drive(log, axis="C", model="affine", **options)
    # 1 rev/min is 360 deg/min.
    assert found.coefficients[0].value == pytest.approx(3.0 / 360.0, rel=1e-3)
    with pytest.raises(InputError, match=r"peaks at .* deg/s, above the 7200 .*likely unit is deg/min"):
        calibrate_drive(
            write(tmp_path / "d.csv", {"t": time, "v": 360.0 * turns, "P": power}),
            axis="C",
            model="affine",
            **options,
        )


def test_a_gap_takes_no_energy(tmp_path):
    whole = write(tmp_path / "whole.csv", swing())
    columns = swing()
    columns["t"] += 100.0 * (np.arange(400) >= 200)
    paused = write(tmp_path / "paused.csv", columns)
    first, second = affine(whole, **TIMED, hold_out=[paused]).runs
    assert second.measured == pytest.approx(first.measured, rel=0.01)
    assert second.time == pytest.approx(first.time, abs=0.02)


def test_dates_without_a_zone_dont_jump_with_summer_time(tmp_path, monkeypatch):
    monkeypatch.setenv("TZ", "Europe/Berlin")
    tzset()
    start = datetime(2026, 3, 29, 2, 59, 50)  # an hour that clocks of Berlin leave out
    dates = [(start + timedelta(seconds=0.05 * i)).isoformat() for i in range(400)]
    speed = 60.0 * np.cos(np.arange(400) * 0.05)
    log = write(tmp_path / "log.csv", {"t": dates, "v": speed, "P": SLOPE * np.abs(speed) + OFFSET})
    try:
        assert not affine(log, **TIMED | {"time_unit": "iso"}).gaps
    finally:
        monkeypatch.undo()
        tzset()
