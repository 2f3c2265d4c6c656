"""Runs of plain blocks, which are read together."""

import pytest
from support.nc_blocks import one_by_one

from fiveaxis.nc.languages.choice import ISO, KLARTEXT, MILLPLUS, SINUMERIK
from fiveaxis.nc.languages.runs import SHORTEST, Run
from fiveaxis.nc.source import Source


@pytest.mark.parametrize(
    ("language", "block", "between"),
    [
        (ISO, "N10 G1 X{}.5 F100 (pass)", ["(a;b) ; (c", "N20", "", "n5 x1 (d)"]),
        (ISO, "X{} I.6 K.8 ; (pass", ["(e)", "K1 (f)", ""]),
        (MILLPLUS, "N10 X{} B20 (pass)", ["(finish)", "N5", ""]),
        (SINUMERIK, "N10 X={} A3=0.6 C3=0.8 ; pass (", ["; é", "N20 ;", "", "C3=1"]),
        (KLARTEXT, "7 L X+{} F100 ; pass", ["8 ; ~ finish", " ;", ""]),
        (KLARTEXT, "LN X{} TX0.6 TZ+0.8", ["9 ; finish"]),
    ],
)
def test_comments_block_numbers_and_blank_lines_do_not_end_a_run(language, block, between):
    lines = [block.format(x) for x in range(SHORTEST)]
    lines[3:3] = lines[9:9] = between
    [run] = language.split(Source("part", lines))
    assert isinstance(run, Run)
    # A form feed makes a line one that is read by itself.
    alone = list(language.split(Source("part", [f"{line}\f" for line in lines])))
    assert not any(isinstance(block, Run) for block in alone)
    assert repr(list(one_by_one([run]))) == repr(alone)


@pytest.mark.parametrize(
    ("language", "line"),
    [(ISO, "X1 (a (b))"), (ISO, "X1 (a"), (SINUMERIK, 'X1 MSG("a;b")'), (KLARTEXT, "L X+1 ; goes on ~")],
)
def test_what_only_looks_like_a_comment_ends_a_run(language, line):
    plain = ["L X+1" if language is KLARTEXT else "X1"] * SHORTEST
    items = language.split(Source("part", [*plain, line, *plain]))
    assert len(next(items)) == SHORTEST
