#!/bin/sh
# A drive's power, read a hair beyond the last measured speed, is 0 W.
#
# Run: casadi 3.7.2 (PyPI), interpolant with "linear" and with "bspline".
#
# Guess before the run: both kinds go on in the same way beyond the table's ends: along the last
# piece, or with the last value. In any case a smooth table has no jump at its end.
#
# What happens: "linear" goes on along its last piece. "bspline" gives exactly 0, with a derivative
# of 0, from the first number beyond the last point, on both sides; with two inputs,
# too, where one of them is beyond. There is no message.
#
# Why it matters: an optimiser that is charged by such a table finds that the axis is free as soon
# as it is faster than it was measured, and goes there. By the derivative nothing leads back. Bound
# the variable by the table's ends, or put points beyond them.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check casadi==3.7.2 numpy==2.2.6 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import casadi as ca
import numpy as np

SPEED = np.linspace(1000.0, 5000.0, 9)  # mm/min
POWER = 200.0 + 1e-5 * SPEED**2  # W
ASKED = (999.99, 1000.0, 3000.0, 5000.0, 5000.01, 6000.0)

print(f"casadi {ca.__version__}")
print("expected beyond 1000 and 5000 mm/min: about the power at the end, 210 and 450 W")
seen = {}
for kind in ("linear", "bspline"):
    speed = ca.MX.sym("speed")
    table = ca.interpolant("table", kind, [SPEED], POWER)
    slope = ca.Function("slope", [speed], [ca.gradient(table(speed), speed)])
    seen[kind] = [round(float(table(one)), 2) for one in ASKED]
    print(f"seen, {kind}: {dict(zip(ASKED, seen[kind]))}, slope at {ASKED[-1]}: {float(slope(ASKED[-1])):g}")
load = np.linspace(0.0, 1.0, 5)
both = ca.interpolant("both", "bspline", [SPEED, load], np.outer(1.0 + load, POWER).ravel())
pair = [round(float(both(ca.vertcat(*point))), 2) for point in ((5000.0, 0.5), (5000.01, 0.5), (5000.0, 1.01))]
print(f"seen, bspline of speed and load, inside, beyond in speed, beyond in load: {pair}")
inside = seen["bspline"][1:4] == [210.0, 290.0, 450.0]
stated = inside and seen["bspline"][::5] + seen["bspline"][4:5] == [0.0, 0.0, 0.0] and seen["linear"][4] == 450.0
stated = stated and pair == [675.0, 0.0, 0.0]
print("as stated" if stated else "CHANGED")
sys.exit(0 if stated else 1)
PYTHON
