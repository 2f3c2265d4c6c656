"""Arithmetic in programs."""

import pytest

from fiveaxis.nc.languages.block import BlockError
from fiveaxis.nc.languages.expressions import evaluate, evaluate_prefix

VALUES = {"#1": 2.0, "#101": 12.5, "#<depth>": -3.0, "#<DEPTH>": -3.0, "R1": 5.0, "Q20": 4.0, "_HOME": -365.0}


def lookup(name):
    return VALUES[name]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12.5", 12.5),
        (".5", 0.5),
        ("7.", 7.0),
        ("-.25", -0.25),
        ("#101", 12.5),
        ("#1+3.5", 5.5),
        ("-#1", -2.0),
        ("#<DEPTH>*2", -6.0),
        ("R1*2", 10.0),
        ("2+3*4", 14.0),
        ("[2+3]*4", 20.0),
        ("(2+[3-1])*4", 16.0),
        ("10-4-3", 3.0),
        ("12/3/2", 2.0),
        ("2--3", 5.0),
        ("2*-3", -6.0),
        # As rs274 has them.
        ("-2**2", 4.0),
        ("2*3**2", 18.0),
        ("2**3**2", 64.0),
        ("ATAN[1]/[-1]", 135.0),
        ("2+1 LT 3 AND 1", 0.0),
        ("1LT3", 1.0),
        ("[#1EQ2]AND[SIN[30]LESIN[60]]", 1.0),
        ("2 NE 2 OR 3 GT 2", 1.0),
        ("2 GE 2 XOR 1 GT 2", 1.0),
        ("FIX[2.8]+FUP[2.2]", 5.0),
        ("LN[EXP[2]]", 2.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("7 MOD 4", 3.0),
        ("-7 DIV 2", -3.0),
        ("+Q20 + +5", 9.0),
        (" 1 + 1 ", 2.0),
        ("SIN(30)", 0.5),
        ("COS[60]*R1", 2.5),
        ("SIN 30 * 2", 1.0),
        ("SIN -30", -0.5),
        ("SQRT(16)+ABS(-1)", 5.0),
        ("ATAN(1)", 45.0),
        ("ROUND(-2.5)", -3.0),
        ("_HOME+5", -360.0),
    ],
)
def test_arithmetic_has_its_usual_meaning(text, value):
    assert evaluate(text, lookup) == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("", "a number is missing"),
        ("1+", "a number is missing"),
        ("R2", "R2 has no value yet"),
        ("#7*2", "#7 has no value"),
        ("1.5E3", "'E3' isn't supported arithmetic"),
        ("1,5", "',5' isn't supported arithmetic"),
        ("1 2", "'2' isn't supported arithmetic"),
        ("(1+2", "'(' isn't closed"),
        ("(1+2]", "'(' isn't closed"),
        (")", "')' where a number"),
        ("*2", "'*' where a number"),
        ("1/0", "has no value: float division by zero"),
        ("5 MOD 0", "has no value"),
        # LinuxCNC and Fanuc differ.
        ("-7 MOD 4", "depends on the control"),
        ("FIX[-2.8]", "depends on the control"),
        ("FUP[3.0000000001]", "depends on the control"),
        ("ATAN[-1]/[2]", "negative on LinuxCNC and above 180 on Fanuc"),
        ("0.1+0.2 GT 0.3", "depends on the control's rounding"),
        ("2 AND 1", "only comparisons can be"),
        ("SQRT(-1)", "has no value"),
        ("9**999", "has no value"),
        ("__IMPORT__('OS')", "__IMPORT__ has no value"),
        ("1" * 41, "is longer than any number"),
        ("(" * 60 + "1" + ")" * 60, "more than 40 brackets"),
        ("-" * 5000 + "1", "more than 40 brackets"),
    ],
)
def test_expressions_without_a_value_are_refused_with_the_reason(text, fact):
    with pytest.raises(BlockError) as caught:
        evaluate(text, lookup)
    assert fact in str(caught.value)


def test_a_prefix_ends_where_no_operator_follows():
    assert evaluate_prefix("X=R1*2 Y=3", 2, lookup) == (10.0, 6)
    assert evaluate_prefix("X#101Y#1", 1, lookup) == (12.5, 5)
    assert evaluate_prefix("X[#1+3.5]Z1", 1, lookup) == (5.5, 9)
