#!/bin/sh
# A square that is turned by 90 degrees is cut across its middle.
#
# Run: bCNC 0.9.16 (PyPI), the function behind its button for turning (GCode.rotateLines), by 90 degrees
# about the zero, on one square with all words on each line, with those that change, and in G91.
#
# Guess before the run: both come out as the same square, 20 mm to the left. The source, read before the
# run, adds a word to a line only if it differs from the same word before turning.
#
# What happens: a corner at X20 Y20 is turned to X-20 Y20. Y is 20 as it was, so it isn't written, and the
# last turned Y stays in force. Two of the four corners are lost, and the path runs diagonally. In G91 a
# line with X only is turned with the Y of the line before. With all words on each line the square is
# right. There is no message.
#
# Why it matters: posts leave out words that don't change, and a job is turned by 90 degrees to suit the
# blank. Here the picture shows it; among thousands of lines of a surface single lost words aren't seen.
# Have X and Y written on each line before turning.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check --no-deps bCNC==0.9.16 svgelements==1.9.6 \
    shxparser==0.0.2 numpy==2.4.6 || exit 2
cd "$folder"
HOME=$folder venv/bin/python - <<'PYTHON'
import sys
from importlib.metadata import version
from importlib.util import find_spec

package = find_spec("bCNC").submodule_search_locations[0]
sys.path[:0] = [package, package + "/lib"]
import CNC  # noqa: E402

SQUARE = "0 0, 0 20, 20 20, 20 0, 0 0"
PROGRAMS = {
    "all words": "G90/G0 X0 Y0/G1 X0 Y20/X20 Y20/X20 Y0/X0 Y0",
    "words that change": "G90/G0 X0 Y0/G1 Y20/X20/Y0/X0",
    "in G91": "G90/G0 X0 Y0/G91/G1 Y20/X20/Y-20/X-20/G90",
}
STATED = {
    "all words": "0 0, -20 0, -20 20, 0 20, 0 0",
    "words that change": "0 0, -20 0, -20 0, 0 20, 0 20",
    "in G91": "0 0, -20 0, -40 0, -40 20, -20 20",
}


def corners(lines):
    place, relative, seen = {"X": 0.0, "Y": 0.0}, False, []
    for line in lines:
        words = line.upper().split()
        relative = {"G91": True, "G90": False}.get(words[0] if words else "", relative)
        for word in words:
            if word[0] in "XY":
                place[word[0]] = float(word[1:]) + (place[word[0]] if relative else 0.0)
        if any(word[0] in "XY" for word in words):
            seen.append(f"{place['X']:g} {place['Y']:g}".replace("-0 ", "0 "))
    return ", ".join(seen)


print("bCNC", version("bCNC"))
print("expected of each: 0 0, -20 0, -20 20, 0 20, 0 0")
as_stated = True
for name, program in PROGRAMS.items():
    with open("square.nc", "w") as file:
        file.write(program.replace("/", "\n") + "\n")
    code = CNC.GCode()
    code.load("square.nc")
    lines = [line for block in code.blocks for line in block]
    assert corners(lines) == SQUARE, lines
    code.rotateLines([(b, n) for b, block in enumerate(code.blocks) for n in range(len(block))], 90.0)
    turned = [line for block in code.blocks for line in block]
    print(f"seen, {name}: {corners(turned)}, by {' / '.join(turned)}")
    as_stated &= corners(turned) == STATED[name]
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
