#!/bin/sh
# A collision checker calls a program safe whose cutter goes through the clamp, if the line that
# does so relies on the G1 of the line before.
#
# Run: gcode-collision-check 0.1.0 (PyPI), its command `verify`, on one box and two programs that
# are the same to every control: with G1 on each line, and with G1 on the first only.
#
# Guess before the run, from its description ("modal state", "verifies the full tool assembly
# along the program"): both programs collide. Its source, read before the run, said otherwise.
#
# What happens: a line with axis words and no G code of motion is not checked. The position is
# carried on, so the next line with a G code starts in the right place and nothing looks odd;
# the report says SAFE and the command exits with 0.
#
# Why it matters: most postprocessors leave out a repeated G1, so nearly all cutting moves of
# their programs go unchecked, and the answer is the one that a machinist acts on. Its list of
# limitations doesn't name this. Give it programs with the motion code on each line.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check gcode-collision-check==0.1.0 \
    trimesh==5.2.0 python-fcl==0.7.0.11 numpy==2.4.6 click==8.5.1 || exit 2
cd "$folder"
venv/bin/python -c 'from trimesh.creation import box
box((20, 40, 30)).apply_translation((100, 0, 0)).export("clamp.stl")'
printf 'G21 G90 G17\nG0 X40 Y0 Z50\nG0 Z5\nG1 X60 F500\nG1 X140\nG0 Z50\nM30\n' >each.nc
sed 's/^G1 X140$/X140/' each.nc >modal.nc
echo "gcode-collision-check $(venv/bin/pip list --disable-pip-version-check |
    sed -n 's/^gcode-collision-check *//p')"
echo "expected of both: a collision at line 5, where the cutter crosses the box"
for name in each modal; do
    code=0
    venv/bin/gcode-collision-check verify "$name.nc" --scene clamp.stl >"$name.txt" 2>&1 || code=$?
    echo "seen, $name.nc: exit $code, $(sed -n 's/^RESULT: *//p' "$name.txt")"
    echo "$code" >>codes
done
if grep -q '^RESULT: COLLISION' each.txt && grep -q '^RESULT: SAFE' modal.txt &&
    [ "$(sed -n 2p codes)" = 0 ]; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
