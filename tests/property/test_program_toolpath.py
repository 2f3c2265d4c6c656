"""Laws of programs as toolpaths: runs are their blocks one by one, frames agree, nonsense is an error."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blocks import one_by_one
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import fiveaxis as fx
from fiveaxis.errors import MachineError, SettingError, ToolError, ToolpathError
from fiveaxis.kinematics import linear_positions, tool_axes, tool_poses
from fiveaxis.machine import Machine, load_machine
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.running import run_program
from fiveaxis.nc.languages.choice import find_language
from fiveaxis.nc.languages.runs import Run
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import Source, load_source
from fiveaxis.options import Wrap

QUIET = settings(
    deadline=None,
    derandomize=True,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
BALL = fx.Tool.ball(6)
# Table and table, table and head, head and head; two of them count axes against ISO 841.
MACHINES = ["hayashi-640123", "linuxcnc-xyzac-trt", "linuxcnc-xyzbc-trt", "linuxcnc-bridgemill"]

# What real programs are made of, control by control.
ISO = """\
%
O0001 (PART)
N10 G21 G90 G94 G17 G40 G80
( TOOL: T1 = 10.0 dia. ENDMILL )
M428 ;TCP:xyzac
G0  X  16.339  Y -25.409  Z  33.353  A -71.841  C -35.930
G1  X   6.302  Y -11.560  Z  27.743  A -71.841  C -35.930  F 318
g1x6.358y-12.418z26.178a-71.266c-32.919f159
G93
X6.3 Y-12.6 Z25.8 F 159
G94 F600
G02 X43.663 Y6.24 I-2.519 J2.229
G03 X1 Y1 R20
G91 G28 Z0.0 M05
G90 G53 G00 Z0.0
G43.4 H1
G43.5 H09
G1 X1 Y2 Z3 I0. J.6 K.8
G49
G54
G98 G81 X1 Y2 Z-5. R2. F250.
G80
#101=12.5
X#101 Y[#101*2]
G68.2 X1 Y2 Z3 I10 J20 K30
G53.1
G69
G4 P1.5
M429
M30
"""
SINUMERIK = """\
N10 G71 G90 G54 ; part
N20 TRAORI
N30 G0 X1 Y2 Z3 A=DC(5) C=10
N40 G1 X=R1+2 A3=0.6 B3=0 C3=.8 F1000
N50 AROT X90
N60 SUPA G0 Z0 D0
N70 CYCLE800(1,"TC1",0,57,0,0,0,10,20,30,0,0,0,-1)
N80 TRAFOOF
N90 M30
"""
KLARTEXT = """\
0 BEGIN PGM part MM
1 TOOL CALL 1 Z S1000
2 L X+10 Y+20 Z+50 R0 FMAX M3
3 M128
4 L X+1 Y+2 Z+3 A+10 C-20 F500
5 LN X+1 Y+2 Z+3 NX+0 NY+0 NZ+1 TX+0 TY+0.6 TZ+0.8 F500
6 CC X+0 Y+0
7 C X+5 Y+5 DR+
8 M129
9 END PGM part MM
"""
MILLPLUS = """\
N10 G70
N20 G74 Z-.1 L1
N30 G7 A5=15. B5=0.0 C5=210. B7=254 C7=255
N40 G00 B=E254 C=E255
N50 G141 L2=0 F2=15000.
N60 G93 X7.8745 Y-5.0965 Z9.2659
N70 G01 X202.4064 Y1 Z2 B-90. C285. F78.7
N80 G03 X.3709 Y-.1923 I.3205 J-.7597
N90 G81 Y.1181 Z-.7874 B9.804 F12.5
N99 G79 X-.4445 Y1.566 Z7.9736
"""
PROGRAMS = [text.split("\n") for text in (ISO, SINUMERIK, KLARTEXT, MILLPLUS)]


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


@settings(QUIET, max_examples=150)
@given(
    lines=st.lists(st.tuples(st.sampled_from(["", "", "G1 ", "G0 "]), run_words), min_size=20, max_size=60),
    others=st.dictionaries(st.integers(0, 60), spoilers, max_size=3),
    suffix=st.sampled_from(sorted(BEGINNINGS)),
    mode=st.sampled_from(["G94", "G93", "fixed", "wrap", "headless", "G91"]),
    remarks=st.lists(st.integers(0, 4), min_size=1, max_size=5),
    for_motion=st.booleans(),
)
@example([("G1 ", "X1 Y2 Z3 A4 C5 F6")] * 40, {}, "nc", "G94", [0], True)
@example([("G1 ", "X1.1 Y2.3 A4.7 F6")] * 40, {}, "nc", "G91", [1], True)
@example([("", f"F{9 + i}") for i in range(30)], {}, "nc", "G94", [0], False)
@example([("", f"X{i} C{i} F5") for i in range(40)], {9: "12 ; b", 20: "X8 ; ~"}, "h", "G94", [1], True)
@example([("G1 ", f"C{50 * i % 360} F5") for i in range(40)], {}, "nc", "wrap", [0, 1], True)
@example(
    [*[("G0 ", "C1")] * 30, ("G1 ", "X1 Y1 Z1 A1 C1 F9")], {0: "G21 G90 G94"}, "nc", "headless", [0], False
)
def test_a_run_of_plain_blocks_is_the_same_block_by_block(
    lines: list[tuple[str, str]],
    others: dict[int, str],
    suffix: str,
    mode: str,
    remarks: list[int],
    for_motion: bool,
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
    require_same_block_by_block(f"part.{suffix}", program, for_motion, wrap=wrap, feed_mm_min=feed)


def require_same_block_by_block(name: str, program: list[str], for_motion: bool, **options: Any) -> None:
    """Compare with a program in which a form feed makes each line one that is read by itself."""
    machine = load_machine("linuxcnc-xyzac-trt")

    def run(end: str) -> object:
        try:
            source = Source(name, [line + end for line in program])
            ran = run_program(source, machine, ReadOptions(machine=machine, **options), for_motion=for_motion)
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


@settings(QUIET, max_examples=100)
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
    for_motion=st.booleans(),
)
@example(["X1"] * 40, ["C3=1"], {20: "X3"}, "mpf", False)
@example(["X1", "Y2"] * 30, ["C3=1", "A3=0.6 C3=0.8"], {20: "A3=0.8 B3=0.6"}, "nc", False)
@example(["X1", "Y2"] * 30, ["A3=2"], {20: "TRAFOOF"}, "nc", False)
@example(["X1", "X2"] * 30, ["C3=1", "A3=1"], {}, "h", False)
def test_a_run_of_tool_directions_is_the_same_block_by_block(
    lines: list[str], directions: list[str], others: dict[int, str], suffix: str, for_motion: bool
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
    require_same_block_by_block(f"part.{suffix}", [*head[suffix], *program], for_motion)


REAL = Path(__file__).parents[3] / "shared" / "data" / "toolpaths"


@pytest.mark.parametrize(
    "name", ["linuxcnc_impeller_xyzac.ngc", "nx_dmu70_840d_traori_inch.mpf", "nx_dmc160u_millplus.nc"]
)
def test_runs_of_real_programs_hold_the_blocks_that_they_stand_for(name: str):
    if not REAL.is_dir():
        pytest.skip("the shared programs are not beside the project")
    source = load_source(REAL / name)
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


@QUIET
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


@QUIET
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


@QUIET
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


# Nonsense


@st.composite
def mutated(draw: st.DrawFn) -> list[str]:
    """Take lines of a real kind of program, some of them twice or not at all, some with other signs."""
    lines = list(draw(st.sampled_from(PROGRAMS)))
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        line = lines[at]
        cut = draw(st.integers(0, len(line)))
        new = draw(
            st.sampled_from(
                ["", "X1", "-", ".", "9" * 20, "G1", "(", ")", "[", "#1", "=", "\u0661", "E5", ";"]
            )
        )
        lines[at] = draw(
            st.sampled_from([line[:cut] + new + line[cut:], line[:cut] + line[cut + 1 :], line[:cut], new])
        )
        if draw(st.booleans()):
            other = draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
    return lines[: draw(st.integers(1, len(lines)))] if draw(st.booleans()) else lines


@settings(QUIET, max_examples=250)
@given(
    lines=mutated(),
    name=st.sampled_from([None, *MACHINES]),
    positions=st.sampled_from(["table", "machine"]),
    known=st.booleans(),
)
@example(lines=PROGRAMS[0], name="linuxcnc-xyzac-trt", positions="table", known=True)
@example(lines=PROGRAMS[3], name="linuxcnc-xyzbc-trt", positions="table", known=False)
def test_no_program_crashes_the_readers(path: Path, lines, name, positions, known):
    machine = None if name is None else load_machine(name)
    path.write_text("\n".join(lines), encoding="utf-8")
    options = {"start": {"X": 0.0, "Y": 0.0, "Z": 0.0}, "zero": {"Z": 1.0}} if known else {}
    faults = []
    try:
        read = fx.read_toolpath(path, tool=BALL, machine=machine, positions=positions, **options)
        assert np.isfinite(read.pivot).all()
        assert (read.feed > 0.0).all()
        np.testing.assert_allclose(np.linalg.norm(read.axis, axis=1), 1.0)
        assert (read.source >= 1).all()
        assert (read.source <= len(lines)).all()
    except (ToolpathError, ToolError, SettingError, MachineError) as fault:
        faults.append(fault)
    if machine is not None:
        try:
            motion = fx.read_program(path, machine, rapid=1000, **options)
            assert np.isfinite(motion.positions).all()
            assert (motion.time >= 0.0).all()
            assert (motion.feed > 0.0).all()
        except (ToolpathError, MachineError) as fault:
            faults.append(fault)
    assert all(str(path) in str(fault) for fault in faults)
