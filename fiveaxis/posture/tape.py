"""CasADi functions evaluated for all rows of an array at once.

A CasADi function is a list of scalar instructions. CasADi's own evaluator runs the list for one location at a
time and holds Python's lock; here one compiled loop runs each instruction for a block of locations, which
takes a fifth of the time and lets threads run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray

# Locations evaluated together: their registers fit into the processor's cache.
BLOCK = 64

# CasADi's instructions that have a compiled form.
CONSTANT = ca.OP_CONST
INPUT = ca.OP_INPUT
OUTPUT = ca.OP_OUTPUT
ADD = ca.OP_ADD
SUBTRACT = ca.OP_SUB
MULTIPLY = ca.OP_MUL
DIVIDE = ca.OP_DIV
NEGATE = ca.OP_NEG
SQUARE = ca.OP_SQ
TWICE = ca.OP_TWICE
INVERT = ca.OP_INV
ROOT = ca.OP_SQRT
SINE = ca.OP_SIN
COSINE = ca.OP_COS
COPY = ca.OP_ASSIGN
KNOWN = {
    CONSTANT, INPUT, OUTPUT, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE, SQUARE, TWICE, INVERT, ROOT,
    SINE, COSINE, COPY,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Tape:
    """A CasADi function of one vector that returns one vector.

    Parameters
    ----------
    steps : (s, 4), operation, target register and two sources; indices for inputs and outputs
    constants : (s,)
    registers, outputs : their numbers
    """

    steps: IntArray
    constants: Array
    registers: int
    outputs: int

    @classmethod
    def of(cls, argument: ca.SX, value: ca.SX) -> Tape:
        """Record an expression, (o,), of a vector of symbols, (p,)."""
        function = ca.Function("tape", [argument], [ca.densify(value)], {"cse": True})
        count = function.n_instructions()
        steps, constants = np.zeros((count, 4), dtype=np.int64), np.zeros(count)
        for k in range(count):
            code = function.instruction_id(k)
            if code not in KNOWN:
                raise ValueError(f"tape: CasADi's instruction {code} has no compiled form; add one")
            sources, targets = function.instruction_input(k), function.instruction_output(k)
            if code == CONSTANT:
                constants[k] = function.instruction_constant(k)
                sources = []
            elif code == INPUT:
                sources = sources[1:]
            elif code == OUTPUT:
                targets = targets[1:]
            steps[k, :2] = code, targets[0]
            steps[k, 2 : 2 + len(sources)] = sources
        return cls(steps, constants, function.sz_w(), value.numel())

    @property
    def parts(self) -> tuple[IntArray, Array, int]:
        """What `play` needs."""
        return self.steps, self.constants, self.registers

    def __call__(self, arguments: Array) -> Array:
        """Evaluate rows of arguments, (n, p) to (n, o)."""
        values = np.empty((len(arguments), self.outputs))
        play(self.steps, self.constants, self.registers, np.ascontiguousarray(arguments), values)
        return values


@compiled
def play(steps: IntArray, constants: Array, registers: int, arguments: Array, values: Array) -> None:
    """Run the instructions of a `Tape` for arguments, (n, p); values, (n, o), are filled in.

    Loops copy element by element: numba takes longer to compile ``a[:] = b`` than all the rest.
    """
    work = np.empty((registers + 1, BLOCK))
    for begin in range(0, len(arguments), BLOCK):
        count = min(BLOCK, len(arguments) - begin)
        for k in range(len(steps)):
            code = steps[k, 0]
            if code == OUTPUT:
                for i in range(count):
                    values[begin + i, steps[k, 1]] = work[steps[k, 2], i]
                continue
            to = work[steps[k, 1]]
            if code == INPUT:
                for i in range(count):
                    to[i] = arguments[begin + i, steps[k, 2]]
                continue
            a, b = work[steps[k, 2]], work[steps[k, 3]]
            if code == MULTIPLY:
                for i in range(BLOCK):
                    to[i] = a[i] * b[i]
            elif code == ADD:
                for i in range(BLOCK):
                    to[i] = a[i] + b[i]
            elif code == SUBTRACT:
                for i in range(BLOCK):
                    to[i] = a[i] - b[i]
            elif code == NEGATE:
                for i in range(BLOCK):
                    to[i] = -a[i]
            elif code == CONSTANT:
                for i in range(BLOCK):
                    to[i] = constants[k]
            elif code == SQUARE:
                for i in range(BLOCK):
                    to[i] = a[i] * a[i]
            elif code == TWICE:
                for i in range(BLOCK):
                    to[i] = 2.0 * a[i]
            elif code == DIVIDE:
                for i in range(BLOCK):
                    to[i] = a[i] / b[i]
            elif code == INVERT:
                for i in range(BLOCK):
                    to[i] = 1.0 / a[i]
            elif code == ROOT:
                for i in range(BLOCK):
                    to[i] = math.sqrt(a[i])
            elif code == SINE:
                for i in range(count):
                    to[i] = math.sin(a[i])
            elif code == COSINE:
                for i in range(count):
                    to[i] = math.cos(a[i])
            else:
                for i in range(BLOCK):
                    to[i] = a[i]
