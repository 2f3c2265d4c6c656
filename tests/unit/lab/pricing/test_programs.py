"""Energy of NC programs: the printed one, the cut, and totals that add up."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from support.unverified_text import write_text
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.base.errors import JobError, MachineError, SettingError, ToolpathError
from fiveaxis.cli.commands import app
from fiveaxis.model import load_machine

# Edem & Balogun (2018), the zigzag program of Table 1; N16 is misprinted there (Y43).
ZIGZAG = (
    """G90 G21
G00 X18 Y74 Z0
N01 G01 Z-0.5 F300
N02 X132 F500
"""
    + "".join(f"Y{74 - 6 * (i + 1)}\nX{18 if i % 2 == 0 else 132}\n" for i in range(8))
    + "N19 G00 Z5\nN20 G00 Z50\nM30\n"
)
PRINTED_J, PRINTED_S = 51044.30, 129.82


@pytest.fixture
def zigzag(tmp_path: Path) -> Path:
    path = tmp_path / "zigzag.nc"
    path.write_text(ZIGZAG)
    return path


@pytest.fixture(scope="module")
def takisawa() -> fx.Machine:
    return load_machine("takisawa-mac-v3")


def run(*words: object):
    return CliRunner().invoke(app, [str(w) for w in words])


def test_the_printed_program_takes_the_printed_energy_and_time(zigzag, takisawa):
    found = fx.program_energy(zigzag, takisawa)
    assert found.energy.total == pytest.approx(PRINTED_J, rel=0.01)
    assert found.energy.total == pytest.approx(PRINTED_J, rel=0.01)
    assert found.energy.time == pytest.approx(PRINTED_S, rel=0.01)
    rows = {row["block"]: row for row in found.rows}
    assert rows["N02 X132 F500"]["X"] == pytest.approx(5328.65, rel=0.005)
    assert rows["Y68"]["Y"] == pytest.approx(340.58, rel=0.001)
    assert rows["N01 G01 Z-0.5 F300"]["Z"] == pytest.approx(11.21, rel=0.05)


def test_a_zigzag_starts_its_axes_in_turn_and_reverses_none(zigzag, takisawa):
    found = fx.program_energy(zigzag, takisawa).energy.steadiness
    # Eight steps of Y between nine passes of X; Z goes down once, and up in two blocks.
    assert found.starts == {"X": 9, "Y": 8, "Z": 2}
    assert found.reversals == {"X": 0, "Y": 0, "Z": 0}


def test_the_last_digit_of_a_word_is_no_start(tmp_path, takisawa):
    file = tmp_path / "digit.nc"
    file.write_text("G21 G90 G94\nG0 X0 Y0 Z0\nG1 X10 F600\nX20 Y0.001\nX10 Y0.002\nX0 Y0.003\n")
    found = fx.program_energy(file, takisawa).energy.steadiness
    assert (found.starts["X"], found.reversals["X"]) == (1, 1)
    assert (found.starts["Y"], found.reversals["Y"]) == (0, 0)


def test_blocks_add_up_to_the_totals(zigzag, takisawa):
    found = fx.program_energy(zigzag, takisawa)
    assert sum(row["energy"] for row in found.rows) == pytest.approx(found.energy.total)
    assert sum(row["time"] for row in found.rows) == pytest.approx(found.energy.time)
    assert sum(row["base"] for row in found.rows) == pytest.approx(found.energy.base)
    assert found.energy.base == pytest.approx(2763.18 * found.energy.time)
    for letter, joules in found.energy.by_axis.items():
        assert sum(row[letter] for row in found.rows) == pytest.approx(joules)


def test_a_heavier_vice_costs_in_proportion_to_the_moved_weight(zigzag, takisawa):
    light = fx.program_energy(zigzag, takisawa.with_load(0.0)).energy.by_axis
    heavy = fx.program_energy(zigzag, takisawa.with_load(315.0)).energy.by_axis
    assert heavy["X"] == pytest.approx(2.0 * light["X"])
    assert heavy["Z"] == light["Z"]


def test_stops_and_accelerations_cost_time_and_the_energy_follows_the_time_law(zigzag, takisawa):
    axes = tuple(replace(a, max_acceleration=500.0) for a in takisawa.axes)
    limited = replace(takisawa, axes=axes)
    programmed = fx.program_energy(zigzag, limited)
    stopping = fx.program_energy(zigzag, limited, corners="exact-stop")
    assert stopping.energy.time > programmed.energy.time
    # A pass of 114 mm from stop to stop: D/v + v/a.
    passes = [row["time"] for row in stopping.rows if row["block"] == "X18"]
    feed = 500.0 / 60.0
    assert passes == pytest.approx([114.0 / feed + feed / 500.0] * len(passes), rel=1e-6)
    assert stopping.by_block.sum() == pytest.approx(stopping.energy.total)


FIGURES = {"spindle_rpm": 4000, "teeth": 4, "depth": 0.5, "width": 6, "tangential": 800, "feed_force": 60}


@pytest.mark.parametrize("corners", ["control", "exact-stop"])
def test_a_feed_force_takes_its_work_along_the_cuts_and_none_in_rapid(zigzag, takisawa, corners):
    """F_f v_f of Eqs. (1) and (5) over time is F_f times the path of the G01 blocks."""
    axes = tuple(replace(axis, max_acceleration=500.0) for axis in takisawa.axes)
    machine, tool = replace(takisawa, axes=axes), fx.Tool.flat(8)
    free = fx.program_energy(zigzag, machine, tool=tool, corners=corners).energy
    cut = fx.program_energy(zigzag, machine, tool=tool, corners=corners, process=FIGURES).energy
    work = {"X": 9 * 114.0, "Y": 48.0, "Z": 0.5}
    for letter, length in work.items():
        assert cut.by_axis[letter] - free.by_axis[letter] == pytest.approx(60.0 * length / 1000.0, rel=1e-6)
    assert cut.travel == free.travel
    if corners == "control":
        assert cut.most - free.most == pytest.approx(60.0 * sum(work.values()) / 1000.0, rel=1e-6)


def test_the_budget_of_a_program_has_the_cut_at_its_feeds(zigzag, takisawa):
    found = fx.program_energy(zigzag, takisawa, tool=fx.Tool.flat(8), process=FIGURES)
    shares = {share.name: share.energy for share in found.budget.shares}
    plunge = fx.cutting_power("flat:8", FIGURES, 300) * 0.1
    moving = fx.cutting_power("flat:8", FIGURES, 500) * (9 * 114.0 + 48.0) / (500.0 / 60.0)
    assert shares["cutting"] == pytest.approx(plunge + moving)
    assert shares["feed drives"] == pytest.approx(found.energy.total)
    assert shares["spindle idle"] is None
    assert found.as_dict()["budget"]["complete"] is False
    assert fx.program_energy(zigzag, takisawa).budget is None


def test_the_verb_prints_the_whole_program_with_a_process(zigzag, tmp_path):
    file = tmp_path / "cut.toml"
    lines = [f"{key} = {value}" for key, value in FIGURES.items()]
    file.write_text("\n".join([*lines, 'basis = "assumed"', 'source = "trial"', ""]))
    words = ("energy", zigzag, "-m", "takisawa-mac-v3", "--process", file)
    text = " ".join(run(*words, "--tool", "flat:8").stdout.split())
    assert "zigzag.nc: whole program" in text
    assert "not known: spindle idle, auxiliary" in text
    failed = run(*words)
    assert failed.exit_code == 2
    assert "the process needs the cutter; name it (--tool flat:10)" in failed.stderr
    file.write_text(file.read_text().replace("teeth", "tooth"))
    failed = run(*words, "--tool", "flat:8")
    assert "cut.toml:2" in failed.stderr
    assert "the nearest known one is 'teeth'" in " ".join(failed.stderr.split())


def test_a_cut_has_the_handbooks_power_in_the_shops_units():
    """a_p a_e v_f k_c/60 000 W with mm, mm/min and N/mm², and C0-free drilling: torque times speed."""
    sharp = FIGURES | {"feed_force": 0}
    assert fx.cutting_power("flat:8", sharp, 500) == pytest.approx(0.5 * 6 * 500 * 800 / 60_000)
    drill = {"spindle_rpm": 550, "teeth": 2, "tangential": 4196.8, "thrust": 0.0}
    assert fx.cutting_power("drill:10:118", drill, 60.5) == pytest.approx(
        4196.8 * np.pi / 4.0 * 100.0 * 60.5 / 60_000
    )


@pytest.mark.parametrize(
    ("tool", "figures", "feed", "message"),
    [
        ("flat:8", {"depht": 1}, 500, "unknown key 'depht'; the nearest known one is 'depth'"),
        ("flat:8", {"depth": None}, 500, "the cut of flat:8 needs depth; add it"),
        ("flat:8", {"thrust": 1.0}, 500, "thrust isn't a figure of flat:8; leave it out"),
        ("drill:8:118", {}, 500, "the cut of drill:8:118 needs thrust; add it"),
        ("drill:8:118", {"thrust": 1.0}, 500, "depth, width, feed_force isn't a figure of drill:8:118"),
        ("bull:8:1", {}, 500, "cutting power is known for ball and flat end mills and for drills"),
        ("flat:8", {"width": 9}, 500, "width of cut is 9 mm, above 8 mm"),
        ("flat:8", {}, 0.0, "feed is 0 mm/s"),
        ("flat:8", {"spindle_rpm": 40}, 1500, "check the units of feed"),
    ],
)
def test_an_impossible_process_is_named(tool, figures, feed, message):
    with pytest.raises(JobError, match=re.escape(message)):
        fx.cutting_power(tool, FIGURES | figures, feed)


def test_a_figure_of_a_program_in_deep_folders_has_room(zigzag, tmp_path):
    deep = tmp_path / "/".join(["a-folder-with-a-rather-long-name"] * 5)
    deep.mkdir(parents=True)
    program = deep / "zigzag.nc"
    program.write_bytes(zigzag.read_bytes())
    figure = tmp_path / "energy.svg"
    assert run("energy", program, "-m", "takisawa-mac-v3", "-o", figure).exit_code == 0
    assert "zigzag.nc" in figure.read_text(encoding="utf-8")
    assert "rather-long" not in figure.read_text(encoding="utf-8")


def test_the_verb_writes_table_figure_and_json(zigzag, tmp_path):
    table, figure = tmp_path / "blocks.csv", tmp_path / "energy.svg"
    result = run("energy", zigzag, "-m", "takisawa-mac-v3", "-o", table, "-o", figure, "--json")
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert document["energy"]["total"] == pytest.approx(PRINTED_J, rel=0.01)
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert len(rows) == len(document["blocks"]) == 20
    assert sum(float(row["energy"]) for row in rows) == pytest.approx(document["energy"]["total"])
    assert ElementTree.parse(figure).getroot().tag == "{http://www.w3.org/2000/svg}svg"
    words = run("energy", zigzag, zigzag, "-m", "takisawa-mac-v3").stdout
    assert "+0.0 %" in words
    assert "starts  reversals" in words
    assert document["energy"]["starts_by_axis"] == {"X": 9, "Y": 8, "Z": 2}
    assert (document["energy"]["starts"], document["energy"]["reversals"]) == (19, 0)


def test_the_verb_shows_the_first_thousand_blocks_and_says_so(tmp_path):
    path = tmp_path / "long.nc"
    path.write_text("G21 G90\nG0 X0 Y0 Z0\nG1 F600\n" + "".join(f"X{i % 7}\n" for i in range(1, 1500)))
    result = run("energy", path, "-m", "takisawa-mac-v3")
    assert "the first 1000 blocks are shown; -o FILE.csv and --json have all" in result.stdout
    assert result.stdout.count("\n") < 1100


def test_a_written_program_costs_what_its_motion_did(tmp_path, hayashi):
    """The optimiser's own motion, written as NC and read back, has the same power integral."""
    from fiveaxis.model import Motion, motion_energy

    turn = np.linspace(0.0, 1.0, 30)
    positions = np.column_stack([30.0 * np.cos(turn), 30.0 * np.sin(turn), 5.0 * turn, -0.3 * turn, turn])
    time = np.full(30, 0.2)
    time[0] = 0.0
    motion = Motion("XYZAC", positions, np.full(30, 5.0), time, np.zeros(30, int), np.arange(30))
    path = write_text(motion, tmp_path / "p.ngc", machine=hayashi)
    found = fx.program_energy(path, hayashi, rapid=5000.0)
    expected = motion_energy(hayashi, motion)
    # Before them is the approach, and after them the way out.
    assert found.by_block[-30:-1].sum() == pytest.approx(expected.total, rel=1e-5)


@pytest.mark.parametrize(("tool", "stated"), [("bull:16:4", True), ("ball:8", False)])
def test_the_feed_of_the_header_counts_where_blocks_do_not_state_it(tmp_path, hayashi, tool, stated):
    """A bull nose goes along its path beside its axis, on a side that no block names; a ball on its axis."""
    path = tmp_path / "p.ngc"
    head = f"(tool: {tool})\n(feed: 1000 mm/min along the path)\nG21 G90 G93\n"
    path.write_text(head + "G0 X20 Y0 Z0 A-30 C0\nG1 X21 A-31 C2 F500\nG1 X22 A-35 C9 F500\n")
    found = fx.program_energy(path, hayashi, rapid=1000.0)
    feeds = found.motion.feed[found.motion.cutting][1:] * 60.0
    assert (feeds == pytest.approx(1000.0)) is stated


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("G90 G21\nG00 X0 Y0 Z0\nG01 X10\n", ToolpathError, "F"),
        ("G90 G21\nG00 X0 Y0 Z0\nG01 X10 F0\n", ToolpathError, "F"),
        ("G90 G21\nG01 X10 F100\n", ToolpathError, "start"),
        ("G90 G21\nG00 X0 Y0 Z0 B5\n", ToolpathError, "B"),
    ],
)
def test_a_program_that_says_too_little_is_refused_with_its_line(tmp_path, takisawa, text, error, said):
    path = tmp_path / "p.nc"
    path.write_text(text)
    with pytest.raises(error, match=said) as caught:
        fx.program_energy(path, takisawa)
    assert str(caught.value).startswith(f"{path}:")


def test_a_machine_without_powers_and_unknown_corners_are_refused(zigzag, takisawa):
    with pytest.raises(MachineError, match="no power for axis"):
        fx.program_energy(zigzag, fx.Machine.from_code("1203"), rapid=1000.0)
    with pytest.raises(SettingError, match="write control, programmed, exact-stop, or a tolerance"):
        fx.program_energy(zigzag, takisawa, corners="smooth")
    assert run("energy", zigzag, "-m", "takisawa-mac-v3", "--start", "X#3").exit_code == 2


def test_a_program_faster_than_its_axes_is_reported(tmp_path, takisawa):
    path = tmp_path / "fast.nc"
    path.write_text("G90 G21\nG00 X0 Y0 Z0\nG01 X100 F50000\nG01 X0 F500\n")
    found = fx.program_energy(path, takisawa)
    [speeding] = [f for f in found.findings if f.code == "feed-over"]
    assert speeding.place.line == 3
    assert "F asks 1 blocks to move X faster than its 166.667 mm/s, up to 833.33" in speeding.message
    travelled = found.motion.moves[:, 0] / takisawa.axes[0].max_speed
    assert (found.motion.time >= np.abs(travelled) - 1e-12).all()
    stopping = fx.program_energy(path, takisawa, corners="exact-stop")
    assert "no-acceleration" in {f.code for f in stopping.findings}
    assert stopping.energy.time == pytest.approx(found.energy.time)


def test_an_arc_is_one_block_of_the_table(tmp_path, takisawa):
    path = tmp_path / "arc.nc"
    path.write_text("G90 G21\nG00 X0 Y0 Z0\nG02 X20 Y0 I10 J0 F500\nG01 X0\n")
    found = fx.program_energy(path, takisawa)
    assert [row["line"] for row in found.rows] == [3, 4]
    assert found.rows[0]["time"] == pytest.approx(10.0 * np.pi / (500.0 / 60.0), rel=1e-3)
    assert sum(row["energy"] for row in found.rows) == pytest.approx(found.energy.total)


def test_options_of_the_verb_are_the_librarys(tmp_path):
    path = tmp_path / "p.nc"
    path.write_text("G90 G21\nG53 G00 Z0\nG00 X0 Y0 Z-5\n/G01 X50 F500\nG01 X10 F500\n")
    machine = ("-m", "takisawa-mac-v3", "--json")
    zero = ("--zero", "X1,Y2,Z-3")
    plain = json.loads(run("energy", path, *machine, *zero).stdout)
    skipped = json.loads(run("energy", path, *machine, *zero, "--block-delete").stdout)
    assert skipped["energy"]["time"] < plain["energy"]["time"]
    assert "names an axis twice" in run("energy", path, *machine[:2], "--start", "X1,X2").stderr
    refused = run("energy", path, *machine[:2], "-o", tmp_path / "x.pdf")
    assert "let it end in .csv, .svg or .html" in refused.stderr
    assert not (tmp_path / "x.pdf").exists()


def test_a_part_away_from_zero_is_priced_where_the_head_or_the_option_puts_it(tmp_path, hayashi):
    """Words of TCP are of the workpiece: how far the axes travel depends on where it stands."""
    from fiveaxis.model import Motion

    turn, columns = np.linspace(0.0, 1.0, 30), np.zeros((30, 5))
    columns[:, 3], columns[:, 4] = -0.3 * turn - 0.5, turn
    time = np.full(30, 0.2)
    motion = Motion("XYZAC", columns, np.full(30, 5.0), time, np.zeros(30, int), np.arange(30))
    there = hayashi.with_setup((40.0, 0.0, -60.0))
    path = write_text(motion, tmp_path / "p.mpf", machine=there, control="sinumerik", coordinates="tip")
    read = fx.program_energy(path, hayashi)
    assert read.energy.total == fx.program_energy(path, there).energy.total
    assert "setup-read" in {f.code for f in read.findings}
    bare = tmp_path / "bare.mpf"
    bare.write_text("\n".join(line for line in path.read_text().splitlines() if "setup" not in line))
    priced = {}
    for options in ((), ("--work-offset", "40,0,-60")):
        shown = run("energy", bare, "-m", "hayashi-640123", *options, "--json")
        priced[options] = json.loads(shown.stdout)["energy"]["total"]
    assert priced["--work-offset", "40,0,-60"] == pytest.approx(read.energy.total)
    assert priced[()] > 2.0 * read.energy.total


@pytest.mark.parametrize("decimals", [3, 4, 6])
def test_head_and_reader_price_the_words_and_rounding_decides_nothing(tmp_path, hayashi, decimals):
    """Y creeps by less than a digit in each block, and the table turns under the tip's words."""
    from fiveaxis.job import post_program
    from fiveaxis.model import Motion, motion_energy
    from fiveaxis.nc import write_motion

    turn = np.linspace(0.0, 1.0, 60)
    positions = np.column_stack([30.0 * turn, 3e-3 * turn, np.full(60, 20.0), -0.3 - 1e-6 * turn, turn])
    time = np.where(np.arange(60) > 0, 0.04, 0.0)
    motion = Motion("XYZAC", positions, np.full(60, 12.7), time, np.zeros(60, int), np.arange(60))
    table = tmp_path / "digits.toml"
    numbers = f"linear = {decimals}, rotary = {decimals}, direction = 9, most = 999999.0"
    table.write_text(f'based_on = "sinumerik"\ntitle = "digits"\nnumber = {{ {numbers} }}\n')
    source, path = write_motion(motion, tmp_path / "motion.csv", hayashi), tmp_path / "p.mpf"
    made = post_program(
        source, hayashi, output=path, control=table, coordinates="tip", thin=False, unverified=True
    ).made
    read = fx.program_energy(path, hayashi).energy
    assert made.energy == read
    assert f"energy: {read.total:.0f} J" in path.read_text()
    # An axis that a digit moves takes what this travel costs, whichever way the digit falls.
    meant = motion_energy(hayashi, motion).total
    priced = motion_energy(hayashi, made.blocks, rounding=made.rounding)
    digit = 10.0**-decimals
    assert priced.total <= priced.most
    assert priced.total == pytest.approx(meant, abs=60.0 * digit * 65.57 / (250.0 / 60.0) + 1e-2 * meant)
