"""Laws of programs as toolpaths: runs are their blocks one by one, frames agree."""

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.nc_blocks import one_by_one

import fiveaxis as fx
from fiveaxis.base import Wrap
from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import Machine, linear_positions, load_machine, tool_axes, tool_poses
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.running import run_program
from fiveaxis.nc.languages.choice import find_language
from fiveaxis.nc.languages.runs import Run
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import Source, load_source

BALL = fx.Tool.ball(6)
# Table and table, table and head, head and head; two of them count axes against ISO 841.
MACHINES = ["hayashi-640123", "linuxcnc-xyzac-trt", "linuxcnc-xyzbc-trt", "linuxcnc-bridgemill"]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "part.nc"


# Runs of plain blocks


def rows_of(ran: Interpreter) -> list[object]:
    """Return the rows as lists, with None for NaN, which equals nothing."""
    if not ran.track.rows:
        return []
    columns = ran.track.columns()
    arrays = [getattr(columns, f.name) for f in fields(columns) if f.name != "machine"]
    return [np.where(np.isnan(array), None, array).tolist() for array in arrays]


# What a long run of plain blocks may have in it, and what interrupts or spoils it.
run_number = st.one_of(
    st.floats(-50, 400).map(lambda x: f"{x:.3f}"), st.sampled_from(["0", "-0.", "+1.5", ".25", " 1", "1"])
)
run_word = st.builds("{}{}".format, st.sampled_from("XYZAC"), run_number)
run_feed = st.one_of(st.floats(1, 5000).map(lambda x: f"F{x:.2f}"), st.sampled_from(["F100", "F.5"]))
run_words = st.lists(
    st.one_of(run_word, run_word, run_feed), min_size=1, max_size=6, unique_by=lambda word: word[0]
).map(" ".join)
spoilers = st.sampled_from(
    ["", "M8", "G91", "G90", "G93", "G94", "X1 X2", "F0", "X2000000", "x1", "U1", "S5", "G2 X1 Y1 R5"]
)
# What may stand beside words, and between lines.
REMARKS = {"nc": ["", "(a)", ";(b", "(c;d) ;e", "((f))"], "mpf": ["", ";(a)"], "h": ["", "; a", ";é"]}
BEGINNINGS = {"nc": "{}", "mpf": "N10 {}", "h": "7 L {}"}


@given(
    lines=st.lists(st.tuples(st.sampled_from(["", "", "G1 ", "G0 "]), run_words), min_size=20, max_size=60),
    others=st.dictionaries(st.integers(0, 60), spoilers, max_size=3),
    suffix=st.sampled_from(sorted(BEGINNINGS)),
    mode=st.sampled_from(["G94", "G93", "fixed", "wrap", "headless", "G91"]),
    remarks=st.lists(st.integers(0, 4), min_size=1, max_size=5),
)
@example([("G1 ", "X1 Y2 Z3 A4 C5 F6")] * 40, {}, "nc", "G94", [0])
@example([("G1 ", "X1.1 Y2.3 A4.7 F6")] * 40, {}, "nc", "G91", [1])
@example([("", f"F{9 + i}") for i in range(30)], {}, "nc", "G94", [0])
@example([("", f"X{i} C{i} F5") for i in range(40)], {9: "12 ; b", 20: "X8 ; ~"}, "h", "G94", [1])
@example([("G1 ", f"C{50 * i % 360} F5") for i in range(40)], {}, "nc", "wrap", [0, 1])
@example([*[("G0 ", "C1")] * 30, ("G1 ", "X1 Y1 Z1 A1 C1 F9")], {0: "G21 G90 G94"}, "nc", "headless", [0])
def test_a_run_of_plain_blocks_is_the_same_block_by_block(
    lines: list[tuple[str, str]],
    others: dict[int, str],
    suffix: str,
    mode: str,
    remarks: list[int],
):
    program = [
        BEGINNINGS[suffix].format(words if suffix == "h" else motion + words) for motion, words in lines
    ]
    known = REMARKS[suffix]
    program = [f"{line} {known[remarks[i % len(remarks)] % len(known)]}" for i, line in enumerate(program)]
    for place, other in others.items():
        program.insert(place, other)
    head = {
        "nc": ["G21 G90", "G0 X0 Y0 Z0 A0 C0", "F100"],
        "mpf": ["G710 G90", "G0 X0 Y0 Z0 A0 C0", "F100"],
        "h": ["L X0 Y0 Z0 A0 C0 FMAX", "L F100"],
    }
    begin = [] if mode == "headless" else head[suffix]
    program = [*begin, *([mode] if mode[0] == "G" and suffix != "h" else []), *program]
    wrap: Wrap | None = "shorter" if mode == "wrap" and suffix != "mpf" else None
    feed = 500.0 if mode == "fixed" else None
    require_same_block_by_block(f"part.{suffix}", program, wrap=wrap, feed_mm_min=feed)


def require_same_block_by_block(name: str, program: list[str], **options: Any) -> None:
    """Compare with a program in which a form feed makes each line one that is read by itself."""
    machine = load_machine("linuxcnc-xyzac-trt")

    def run(end: str) -> object:
        try:
            source = Source(name, [line + end for line in program])
            ran = run_program(source, machine, ReadOptions(machine=machine, **options))
        except ToolpathError as fault:
            return str(fault)
        ignored = {word: n for word, n in ran.ignored.items() if n}
        modes = (ran.modes.motion, ran.modes.feed, ran.modes.feed_mode)
        state = (ran.track.now, ran.track.vector, ran.track.approach)
        return rows_of(ran), state, ignored, modes, ran.findings

    assert run("") == run("\f")


linear_words = st.lists(
    st.builds("{}{}".format, st.sampled_from("XYZ"), st.integers(-9, 9)),
    min_size=1,
    max_size=3,
    unique_by=lambda word: word[0],
).map(" ".join)
KLARTEXT_WORDS = {"A3=": "TX", "B3=": "TY", "C3=": "TZ", "A5=": "NX", "B5=": "NY", "C5=": "NZ"}
ISO_WORDS = {"A3=": "I", "B3=": "J", "C3=": "K", " [ABC]5=[0-9.]+": "", "TRAFOOF": "G2 X1 Y1 I5"}


@given(
    lines=st.lists(linear_words, min_size=20, max_size=60),
    directions=st.lists(
        st.sampled_from(
            ["A3=0 B3=0.6 C3=0.8", "A3=1", "C3=1", "A5=0.6 C5=0.8 B3=0.6 C3=0.8", "A5=1 C3=1", "C3=1 F60"]
        ),
        min_size=1,
        max_size=3,
    ),
    others=st.dictionaries(
        st.integers(0, 60),
        st.sampled_from(["", "X9", "A10 C5", "A3=1 A10", "F9", "G0 X7", "TRAFOOF"]),
        max_size=2,
    ),
    suffix=st.sampled_from(["nc", "mpf", "h"]),
)
@example(["X1"] * 40, ["C3=1"], {20: "X3"}, "mpf")
@example(["X1", "Y2"] * 30, ["C3=1", "A3=0.6 C3=0.8"], {20: "A3=0.8 B3=0.6"}, "nc")
@example(["X1", "Y2"] * 30, ["A3=2"], {20: "TRAFOOF"}, "nc")
@example(["X1", "X2"] * 30, ["C3=1", "A3=1"], {}, "h")
def test_a_run_of_tool_directions_is_the_same_block_by_block(
    lines: list[str], directions: list[str], others: dict[int, str], suffix: str
):
    program = [f"{words} {directions[i % len(directions)]}" for i, words in enumerate(lines)]
    # Without words of a direction, the one in force holds.
    program += lines
    for place, other in others.items():
        program.insert(place, other)
    if suffix == "nc":
        for sinumerik, iso in ISO_WORDS.items():
            program = [re.sub(sinumerik, iso, line) for line in program]
    if suffix == "h":
        for sinumerik, klartext in KLARTEXT_WORDS.items():
            program = [line.replace(sinumerik, klartext) for line in program]
        program = [f"LN {line.replace('G0', '')}" for line in program if line != "TRAFOOF"]
    head = {
        "nc": ["G21 G90 G94", "G43.5 H1", "G0 X0 Y0 Z0 I0 J0 K1", "G1 F100"],
        "mpf": ["G710 G90 G94", "TRAORI", "G0 X0 Y0 Z0 A3=0 B3=0 C3=1", "G1 F100"],
        "h": ["M128", "LN X0 Y0 Z0 TZ1 FMAX", "L F100"],
    }
    require_same_block_by_block(f"part.{suffix}", [*head[suffix], *program])


@pytest.mark.parametrize(
    "name", ["linuxcnc_impeller_xyzac.ngc", "nx_dmu70_840d_traori_inch.mpf", "nx_dmc160u_millplus.nc"]
)
def test_runs_of_real_programs_hold_the_blocks_that_they_stand_for(name: str, data: Path):
    source = load_source(data / "toolpaths" / name)
    alone = Source(source.name, [f"{line}\f" for line in source.lines])
    split = find_language(source).split
    items = list(split(source))
    assert repr(list(one_by_one(items))) == repr(list(split(alone)))
    assert sum(len(item) for item in items if isinstance(item, Run)) > 600


# Frames and units

angle = st.floats(-170, 170).map(lambda x: round(x, 3))
place = st.floats(-300, 300).map(lambda x: round(x, 3))
poses = st.lists(st.tuples(place, place, place, angle, angle), min_size=1, max_size=6)


def words_of(machine: Machine, values: np.ndarray) -> str:
    return " ".join(f"{c}{v:.9f}" for c, v in zip(machine.letters, values, strict=True))


@given(rows=poses, name=st.sampled_from(MACHINES))
def test_positions_of_axes_and_of_the_tip_are_one_path(path: Path, rows, name: str):
    """What inverse kinematics makes of tips is read back as those tips."""
    machine = load_machine(name)
    tips, angles = np.array(rows)[:, :3], np.radians(np.array(rows)[:, 3:])
    positions = linear_positions(machine, tips, angles)
    counted = machine.shown(positions) * [-1.0 if a.reversed else 1.0 for a in machine.axes]
    path.write_text("G21 G0 " + "\nG1 F60 ".join(words_of(machine, v) for v in counted), encoding="utf-8")
    by_axes = fx.read_toolpath(path, tool=BALL, machine=machine)
    columns = [machine.column(c) for c in "XYZ"]
    counted[:, columns] = tips
    path.write_text(
        "G21 M428\nG0 " + "\nG1 F60 ".join(words_of(machine, v) for v in counted), encoding="utf-8"
    )
    by_tip = fx.read_toolpath(path, tool=BALL, machine=machine)
    np.testing.assert_allclose(by_axes.tips(by_axes.axis), by_tip.tips(by_tip.axis), atol=1e-6)
    np.testing.assert_allclose(by_axes.axis, by_tip.axis, atol=1e-8)
    wanted = tool_axes(machine, angles)
    assert np.abs(by_tip.axis[:, None] - wanted[None]).max(axis=2).min(axis=1).max() < 1e-8


@given(rows=poses, name=st.sampled_from(MACHINES))
def test_a_point_of_the_machine_is_where_the_machine_leads_the_tip(path: Path, rows, name: str):
    """In a standing frame the words are the axes' own, as they are without tip control, but for the tool."""
    machine = load_machine(name)
    heads = [c for c in machine.code.head if c in "ABC"]
    values = np.array(rows)
    values[:, [3 + machine.letters[3:].index(c) for c in heads]] = 0.0
    home, _ = tool_poses(machine, np.zeros((1, 5)))
    words = "G1 F60 ".join(words_of(machine, v) + "\n" for v in values)
    path.write_text("G21 M428\nG0 " + words, encoding="utf-8")
    standing = fx.read_toolpath(path, tool=BALL, machine=machine, positions="machine")
    values[:, :3] -= home
    words = "G1 F60 ".join(words_of(machine, v) + "\n" for v in values)
    path.write_text("G21 G0 " + words, encoding="utf-8")
    by_axes = fx.read_toolpath(path, tool=BALL, machine=machine)
    np.testing.assert_allclose(standing.tips(standing.axis), by_axes.tips(by_axes.axis), atol=1e-6)


@given(rows=poses, machine=st.sampled_from(MACHINES))
def test_inches_and_millimetres_say_the_same(path: Path, rows, machine: str):
    used = load_machine(machine)
    read = []
    for word, scale in (("G21", 1.0), ("G20", 25.4)):
        lines = [
            words_of(used, np.array(v) / [scale, scale, scale, 1, 1]) + f" F{1200 / scale:.6f}" for v in rows
        ]
        path.write_text(f"{word} M428\nG0 " + "\nG1 ".join(lines), encoding="utf-8")
        read.append(fx.read_toolpath(path, tool=BALL, machine=used))
    a, b = read
    np.testing.assert_allclose(a.pivot, b.pivot, atol=1e-5)
    # Where the tip stands and the tool turns, F counts in degrees and has no unit of length.
    steps = np.linalg.norm(np.diff(a.tips(a.axis), axis=0, prepend=np.nan), axis=1)
    moving = a.cutting & (steps > 0.01)
    np.testing.assert_allclose(a.feed[moving], b.feed[moving], rtol=1e-3)
