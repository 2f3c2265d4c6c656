#!/bin/sh
# A parser makes G43 of G43.4, G54 of G54.1 P2 and G68 of G68.2, without the words that follow.
#
# Run: gcodeparser 0.3.0 (PyPI), parse_gcode_lines.
#
# Guess before the run, for G54.1 and G68.2: the command is ("G", 54.1), with P in its parameters;
# ("G", 68.2), with its origin and angles. G43.4 had been seen to be cut when that was written.
#
# What happens: the code is cut at its point, and everything up to the next code goes with it:
# G43.4 H1 Z50. is G43 without H and Z. Nothing tells the two apart afterwards, and no error is
# raised. Codes without a point, and the values of words, are read well.
#
# Why it matters: the codes that make a program five-axis have points. With tool centre point
# control taken for a plain length offset, a tilted plane for a rotation without an angle, and the
# second extra work offset for the first plain one, what is drawn or checked is another part. The
# package names no control, and its documentation doesn't limit the codes; subcodes with a point
# are usual on printers too. Look for a point in the codes before using it.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check gcodeparser==0.3.0 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from importlib.metadata import version

from gcodeparser import parse_gcode_lines

STATED = {
    "G43 H1 Z50.5": [(("G", 43), {"H": 1, "Z": 50.5})],
    "G43.4 H1 Z50.5": [(("G", 43), {})],
    "G54.1 P2": [(("G", 54), {})],
    "G68.2 X1 Y2 Z3 I10 J20 K30": [(("G", 68), {})],
    "G43.4 H1 G1 X5": [(("G", 43), {}), (("G", 1), {"X": 5})],
}
print("gcodeparser", version("gcodeparser"))
print("expected: the code with its point, and its words")
as_stated = True
for text, stated in STATED.items():
    seen = [(line.command, line.params) for line in parse_gcode_lines(text)]
    print(f"seen: {text!r} is {seen}")
    as_stated &= seen == stated
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
