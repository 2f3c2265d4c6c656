"""The Haas trunnion of a public program, which no library machine is like."""

from dataclasses import replace

from fiveaxis.model import Machine


def haas_trunnion() -> Machine:
    """Return it: A tilts, and B, despite its letter, turns about Z on it."""
    machine = Machine.from_code("540123")
    joints = tuple(
        replace(j, line=replace(j.line, direction=(0.0, 0.0, 1.0))) if j.letter == "B" else j
        for j in machine.chain.joints
    )
    # This control counts B as the table turns: p = Rz(B) Rx(-A) (X, Y, Z), see ../shared/data/README.md.
    axes = tuple(replace(a, reversed=a.letter == "A") for a in machine.axes)
    return replace(machine, chain=replace(machine.chain, joints=joints), axes=axes)
