"""How high the part stands over an assumed table: one number in head, answers, report and `verify`."""

import re

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.job import load_surroundings, make_job, resolve, run_job
from fiveaxis.model import parse_tool
from fiveaxis.nc import write_toolpath
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside

TOOL = """shape = "ball"
diameter = 8
length = 20
shank_diameter = 8
[holder]
stick_out = 60
sections = [{ length = 30, diameter = 32 }]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A ring on an overhanging wall, 40 mm in diameter, 15 mm high, and a part under it."""
    folder = tmp_path_factory.mktemp("over")
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(60, -0.2)])
    contact = 20.0 * normal * [1.0, 1.0, 0.0] + [0.0, 0.0, 15.0]
    write_toolpath(
        fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), name="ring"), folder / "ring.csv"
    )
    folder.joinpath("tool.toml").write_text(TOOL)
    return folder


def run(folder, **settings):
    common = {"tool": str(folder / "tool.toml"), "machine": "hayashi-640123", "effort": "quick"}
    return run_job(make_job(input=folder / "ring.csv", tilt=(15.0, 75.0), **common, **settings))


def written(outcome, folder):
    path = folder / f"program{outcome.program.text.suffix}"
    return outcome.program.write(path)


def checked(program, folder, **settings):
    machine, tool = fx.load_machine("hayashi-640123"), parse_tool(str(folder / "tool.toml"))
    return fx.verify_program(program, machine, tool=tool, **settings)


@pytest.fixture(scope="module")
def unstated(folder):
    return run(folder)


@pytest.fixture(scope="module")
def stated(folder):
    return run(folder, above_table=60.0)


def test_a_height_that_nobody_stated_is_told_everywhere_as_one_number(unstated, folder):
    standing = unstated.verdict.standing
    needed = standing.needed
    assert needed > 0.0
    assert unstated.report.answers.next.text.startswith(
        f"Set the part’s zero at X 0, Y 0, Z 0 of the machine, its lowest point at least {needed:g} mm "
        "above the table (assumed; nobody described it)."
    )
    assert f"table: assumed, at least {needed:g} mm below the lowest point" in unstated.program.text.text
    assert unstated.document["verification"]["table"] == {
        "above_mm": needed,
        "needed_mm": needed,
        "stated": False,
    }
    (risk,) = [gap for gap in unstated.verdict.risks if gap.add.startswith("above_table")]
    assert f"at least {needed:g} mm" in risk.sentence
    assert checked(written(unstated, folder), folder).standing.needed == needed


def test_a_stated_height_is_no_risk_and_is_read_from_the_head(stated, folder):
    assert stated.ok
    assert not [gap for gap in stated.verdict.risks if gap.add.startswith("above_table")]
    assert "its lowest point 60 mm above the table. Load" in stated.report.answers.next.text
    assert re.search(r"\(table: 60 mm below the lowest point of the part\)", stated.program.text.text)
    program = written(stated, folder)
    found = checked(program, folder)
    assert found.standing == stated.verdict.standing
    assert found.ok
    # What is given comes first.
    low = checked(program, folder, above_table=0.0)
    assert not low.ok
    assert low.standing.needed == found.standing.needed


def test_the_search_keeps_clear_of_a_table_that_is_stated(folder):
    low = run(folder, above_table=12.0)
    assert low.ok
    assert low.verdict.standing.needed <= 12.0


def test_what_is_assumed_is_drawn_and_said_to_be(stated):
    solution = stated.solution
    page = render_page(solution, Beside(program=stated.program, surroundings=solution.surroundings))
    assert "Brown-red: assumed spindle nose and assumed table, checked in place of [[bodies]]." in page


def test_a_program_under_tcp_is_optimised_where_its_head_says_that_the_part_stands(folder):
    setup = {"offset": (0.0, 0.0, 40.0)}
    first = run(folder, control="fanuc", coordinates="tip", above_table=60.0, setup=setup)
    again = {"input": written(first, folder), "machine": "hayashi-640123", "tool": str(folder / "tool.toml")}
    there = resolve(make_job(cone=20.0, **again))
    assert there.machine.setup.offset == (0.0, 0.0, 40.0)
    assert "setup-read" in {f.code for f in there.toolpath.findings}
    assert load_surroundings(there.job).above_table == 60.0
    # What the job says comes first.
    given = resolve(make_job(cone=20.0, above_table=5.0, setup={"offset": (1.0, 2.0, 3.0)}, **again))
    assert given.machine.setup.offset == (1.0, 2.0, 3.0)
    assert load_surroundings(given.job).above_table == 5.0
