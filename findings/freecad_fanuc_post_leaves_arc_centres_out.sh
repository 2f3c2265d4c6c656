#!/bin/sh
# The second layer of a pocket is posted with its arcs' centres left out.
#
# Run: freecadcmd of Debian 12's freecad 0.20.2, its postprocessors fanuc, uccnc, linuxcnc, mach3_mach4,
# dynapath, centroid and grbl with their own settings, on the same arc at two depths.
#
# Guess before the run: a post that leaves repeated words out does so for X, Y, Z and F, which hold until
# they change. I and J don't: each arc has its own. (A look at fanuc's arcs for their plane showed it.)
#
# What happens: fanuc and uccnc compare I, J and K with those of the last arc, however many straight
# moves lie between, and leave out what is the same: G2 X10.000 is all that is written of the second
# arc. The other posts write I5 J0 again. There is no message.
#
# Why it matters: an arc without I, J, K and R is left out by UCCNC (FreeCAD's issue 23185, of 2025), and
# a Fanuc stops there or cuts straight across, through the boss that the arc goes around, as its
# parameters have it. FreeCAD's simulator is right, as it doesn't see the post. Post for fanuc with
# --no-axis-modal, and look for G2 and G3 without I and J.
#
# Exit: 0 as described, 1 it has changed, 2 another or no freecad is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' freecad) || exit 2
echo "freecad $version"
[ "$version" = "0.20.2+dfsg1-4+deb12u1" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat >run.py <<'PYTHON'
import FreeCAD
import Path
import PathScripts.PathJob as PathJob
from PathScripts.PathPostProcessor import PostProcessor

document = FreeCAD.newDocument("part")
box = document.addObject("Part::Box", "Box")
document.recompute()
PathJob.Create("Job", [box], None)
operation = document.addObject("Path::Feature", "Operation")
commands = []
for depth in (-1, -2):
    commands += [
        Path.Command("G0", {"X": 0, "Y": 0, "Z": 5}),
        Path.Command("G1", {"Z": depth, "F": 2}),
        Path.Command("G2", {"X": 10, "Y": 0, "Z": depth, "I": 5, "J": 0, "F": 5}),
        Path.Command("G1", {"X": 10, "Y": 20, "F": 5}),
    ]
operation.Path = Path.Path(commands)
document.recompute()
for name in ("fanuc", "uccnc", "linuxcnc", "mach3_mach4", "dynapath", "centroid", "grbl"):
    PostProcessor.load(name).export([operation], name + ".nc", "--no-show-editor")
PostProcessor.load("fanuc").export([operation], "fanuc-no-axis-modal.nc", "--no-show-editor --no-axis-modal")
PYTHON
HOME=$folder freecadcmd run.py >log 2>&1 </dev/null || true
echo "expected of each: both arcs with I5 and J0, or R5"
for name in fanuc uccnc fanuc-no-axis-modal linuxcnc mach3_mach4 dynapath centroid grbl; do
    arcs=$(grep '^G2 ' "$name.nc" | grep -oE '^G2|[IJKR]-?[0-9]+\.[0-9]' | tr '\n' ' ')
    echo "$name: $arcs"
done | tee seen
cat >wanted <<'TEXT'
fanuc: G2 I5.0 J0.0 G2 
uccnc: G2 I5.0 J0.0 G2 
fanuc-no-axis-modal: G2 I5.0 J0.0 G2 I5.0 J0.0 
linuxcnc: G2 I5.0 J0.0 G2 I5.0 J0.0 
mach3_mach4: G2 I5.0 J0.0 G2 I5.0 J0.0 
dynapath: G2 I5.0 J0.0 G2 I5.0 J0.0 
centroid: G2 I5.0 J0.0 G2 I5.0 J0.0 
grbl: G2 I5.0 J0.0 G2 I5.0 J0.0 
TEXT
if cmp -s seen wanted; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
