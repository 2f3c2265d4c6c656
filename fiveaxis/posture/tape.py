"""CasADi functions evaluated for all rows of an array at once.

A CasADi function is a list of scalar instructions. Here one compiled loop runs each of them for a block of
locations: that takes a tenth of the time of CasADi's own evaluator, and lets other threads run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fiveaxis.base import Array, IntArray, compiled, sine

# Locations evaluated together: their registers fit into the processor's cache.
BLOCK = 64

# CasADi's instructions that have a compiled form.
CONSTANT, INPUT, OUTPUT, COPY = ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_ASSIGN
ADD, SUBTRACT, MULTIPLY, DIVIDE = ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV
NEGATE, INVERT, ROOT, SINE, COSINE = ca.OP_NEG, ca.OP_INV, ca.OP_SQRT, ca.OP_SIN, ca.OP_COS
KNOWN = {CONSTANT, INPUT, OUTPUT, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE, INVERT, ROOT, SINE, COSINE, COPY}
# Those of one number that are others of twice the same.
WITH_ITSELF = {ca.OP_SQ: MULTIPLY, ca.OP_TWICE: ADD}


@dataclass(frozen=True, eq=False)
class Tape:
    """A CasADi function of one vector that returns one vector.

    Steps, (s, 4), are operation, target register and two sources; inputs and outputs have indices instead.
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
        held: dict[int, int] = {}
        free: list[int] = []
        registers = 0
        # Backwards, so that a step's target is still taken when its sources get their registers: a loop that
        # writes none of what it reads is vectorised.
        for k in range(count - 1, -1, -1):
            code, sources = function.instruction_id(k), function.instruction_input(k)
            if code in WITH_ITSELF:
                code, sources = WITH_ITSELF[code], 2 * sources
            if code not in KNOWN:
                raise ValueError(f"tape: CasADi's instruction {code} has no compiled form; add one")
            targets = function.instruction_output(k)
            steps[k, 0], steps[k, 1] = code, targets[1] if code == OUTPUT else held.pop(targets[0])
            if code == CONSTANT:
                constants[k] = function.instruction_constant(k)
            elif code == INPUT:
                steps[k, 2] = sources[1]
            else:
                for j, source in enumerate(sources):
                    if source not in held:
                        held[source] = free.pop() if free else registers
                        registers = max(registers, held[source] + 1)
                    steps[k, 2 + j] = held[source]
            if code != OUTPUT:
                free.append(int(steps[k, 1]))
        return cls(steps, constants, registers, value.numel())

    @property
    def parts(self) -> tuple[IntArray, Array, int]:
        """What `play` needs."""
        return self.steps, self.constants, self.registers

    def __call__(self, arguments: Array) -> Array:
        """Evaluate rows of arguments, (n, p) to (n, o)."""
        values = np.empty((len(arguments), self.outputs))
        self.evaluate(np.ascontiguousarray(arguments), values)
        return values

    def evaluate(self, arguments: Array, values: Array) -> None:
        """Evaluate rows of arguments, (n, p or more), into the first columns of values, (n, o or more)."""
        play(*self.parts, arguments, values)


@compiled
def play(steps: IntArray, constants: Array, registers: int, arguments: Array, values: Array) -> None:
    """Run the instructions of a `Tape` for arguments, (n, p); values, (n, o), are filled in.

    Registers are read by index: numba counts references to every view of an array. Loops copy element by
    element: it takes longer to compile ``a[:] = b`` than all the rest.
    """
    work = np.empty((registers, BLOCK))
    for begin in range(0, len(arguments), BLOCK):
        count = min(BLOCK, len(arguments) - begin)
        for k in range(len(steps)):
            code, to, a, b = steps[k, 0], steps[k, 1], steps[k, 2], steps[k, 3]
            if code == MULTIPLY:
                for i in range(count):
                    work[to, i] = work[a, i] * work[b, i]
            elif code == ADD:
                for i in range(count):
                    work[to, i] = work[a, i] + work[b, i]
            elif code == SUBTRACT:
                for i in range(count):
                    work[to, i] = work[a, i] - work[b, i]
            elif code == OUTPUT:
                for i in range(count):
                    values[begin + i, to] = work[a, i]
            elif code == INPUT:
                for i in range(count):
                    work[to, i] = arguments[begin + i, a]
            elif code == NEGATE:
                for i in range(count):
                    work[to, i] = -work[a, i]
            elif code == CONSTANT:
                for i in range(count):
                    work[to, i] = constants[k]
            elif code == DIVIDE:
                for i in range(count):
                    work[to, i] = work[a, i] / work[b, i]
            elif code == INVERT:
                for i in range(count):
                    work[to, i] = 1.0 / work[a, i]
            elif code == ROOT:
                for i in range(count):
                    work[to, i] = math.sqrt(work[a, i])
            elif code == SINE:
                for i in range(count):
                    work[to, i] = sine(work[a, i], 0.0)
            elif code == COSINE:
                for i in range(count):
                    work[to, i] = sine(work[a, i], 1.0)
            else:
                for i in range(count):
                    work[to, i] = work[a, i]
