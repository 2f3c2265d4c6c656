"""Laws of F per minute by axis words: what is written for a time is read as that time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.model import Motion, MoveKind, load_machine
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program, read_program

MACHINE = load_machine("linuxcnc-xyzac-trt")
KNOWN = [name for name, d in DIALECTS.items() if "axes" in d.modes and d.mixed_feed.degree is not None]
# mm and deg of a move; s; mm/min, half a step of F.
STEPS = st.sampled_from([0.0, 0.0, 0.5, -1.0, 7.25, -12.5])
HALF = 0.55e-3


@pytest.mark.parametrize("unit", ["mm", "inch"])
@pytest.mark.parametrize("control", KNOWN)
@settings(max_examples=15)
@given(steps=arrays(float, (4, 5), elements=STEPS), time=arrays(float, 4, elements=st.floats(0.1, 5.0)))
def test_a_time_that_is_written_as_f_is_read(tmp_path, control, unit, steps, time):
    table = tmp_path / f"{control}{DIALECTS[control].suffix}.toml"
    table.write_text(f'based_on = "{control}"\n[modes.axes]\nfeed = "per_minute"\n', encoding="utf-8")
    if unit not in DIALECTS[control].unit:
        return
    steps[(steps == 0.0).all(axis=1), 0] = 1.0
    values = np.vstack([np.zeros(5), np.cumsum(steps, axis=0)])
    motion = Motion(
        letters=MACHINE.letters,
        positions=values / MACHINE.shown(np.ones(5)),
        feed=np.full(5, 10.0),
        time=np.append(0.0, time),
        kind=np.full(5, MoveKind.CUT),
        source=np.arange(1, 6),
    )
    program = compose_program(
        motion,
        machine=MACHINE,
        control=table,
        coordinates="axes",
        settings=ProgramSettings(way_out=False, unit=unit),
    )
    path = tmp_path / f"part{program.suffix}"
    path.write_text(program.text, encoding="ascii")
    # The program's header says what F counts, or without it the machine's control.
    again = read_program(path, MACHINE, rapid=6e3)
    bare = [line for line in program.lines if "degree: counts" not in line.lower()]
    path.write_text("\n".join(bare), encoding="ascii")
    by_machine = read_program(path, replace(MACHINE, control=str(table)), rapid=6e3)
    assert len(bare) == len(program.lines) - 1
    feeds = [float(line.rpartition(" F")[2]) for line in program.lines if " F" in line and "G1" in line]
    for read in (again, by_machine):
        np.testing.assert_allclose(read.time[-4:], time, rtol=2e-6 + HALF / min(feeds))
    assert "feed-meaning" not in [finding.code for finding in again.findings]
