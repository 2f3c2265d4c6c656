"""Compiled evaluation against CasADi's own."""

import casadi as ca
import numpy as np
import pytest

from fiveaxis.model import Tool, load_machine
from fiveaxis.posture.tape import COSINE, INPUT, OUTPUT, SINE, Tape
from fiveaxis.posture.terms import location_tapes


@pytest.mark.parametrize("count", [0, 1, 63, 64, 65, 200])
def test_a_tape_returns_what_casadi_returns_but_for_the_last_digit_of_sines(count):
    x = ca.SX.sym("x", 3)
    a, b, c = ca.vertsplit(x)
    value = ca.vertcat(
        ca.sin(a) * b - ca.cos(c) / (2.0 + b * b),
        ca.sqrt(c * c + 1.0) + 1.0 / (3.0 + ca.sin(a)),
        -a,
        2.0 * b + 0.25,
        ca.SX(0.0),
        ca.jacobian(ca.sin(a) * ca.cos(b) / ca.sqrt(2.0 + c), x).T,
    )
    rows = np.random.default_rng(1).uniform(-1.0, 1.0, (count, 3))
    found = Tape.of(x, value)(rows)
    function = ca.Function("same", [x], [value])
    expected = np.array([np.array(function(row)).ravel() for row in rows]).reshape(count, value.numel())
    np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-15)


def test_where_casadi_returns_no_finite_number_a_tape_returns_the_same():
    x = ca.SX.sym("x")
    found = Tape.of(x, ca.vertcat(1.0 / x, ca.sqrt(x)))(np.array([[0.0], [-1.0]]))
    assert np.isinf(found[0, 0])
    assert np.isnan(found[1, 1])


def test_an_instruction_without_a_compiled_form_is_an_error():
    x = ca.SX.sym("x")
    with pytest.raises(ValueError, match="no compiled form"):
        Tape.of(x, ca.erf(x))


@pytest.mark.parametrize("name", ["values", "gradients", "second_derivatives", "derivatives"])
@pytest.mark.parametrize("tool", [Tool.ball(6), Tool.bull(10, 2)], ids=["ball", "bull"])
def test_a_locations_tape_writes_no_register_it_reads_and_has_two_sines_and_two_cosines(name, tool):
    steps = getattr(location_tapes(load_machine("hayashi-640123"), tool.zone), name).steps
    codes = steps[:, 0].tolist()
    assert (codes.count(SINE), codes.count(COSINE)) == (2, 2)
    between = steps[(steps[:, 0] != INPUT) & (steps[:, 0] != OUTPUT)]
    # A constant reads nothing; its sources are 0.
    reading = between[between[:, 2:].any(axis=1)]
    assert len(reading) > 20
    assert not (reading[:, [1]] == reading[:, 2:3]).any()
