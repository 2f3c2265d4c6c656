#!/bin/sh
# FreeCAD imports an inch program as millimetres, and leaves lines without blanks out.
#
# Run: freecadcmd of Debian 12's freecad 0.20.2, its G-code importer (gcode_pre) into a job, on
# the same square in inches (G20) and in millimetres (G21), with and without blanks between words.
#
# Guess before the run, from its pull request 1450 ("importing g-code correctly processes G20/G21"):
# the inch square is 25.4 mm wide, as the millimetre one is; blanks don't matter. The importer's
# source, read before the run, said otherwise: a line is kept only if its first word, up to a
# blank, is one of thirteen codes, and G20 isn't among them.
#
# What happens: the inch square comes in 1 mm wide, without a message, and is posted with G21 in
# front. Of programs without blanks nothing comes in, not even an operation, and nothing is said.
# FreeCAD's own Path.Path(text) does read G20; the importer takes the line away before.
#
# Why it matters: the posted program cuts the shape 25.4 times too small near the zero, in depths
# that are 25.4 times too small as well, so that nothing breaks and the part is spoilt. Many posts
# write no blanks at all. Convert the program to G21 with blanks first, and measure one known
# width after the import.
#
# Exit: 0 as described, 1 it has changed, 2 another or no freecad is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' freecad) || exit 2
echo "freecad $version"
[ "$version" = "0.20.2+dfsg1-4+deb12u1" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
printf 'G21 G90\nG0 X0 Y0\nG1 X25.4\nG1 Y25.4\nG1 X0\nG1 Y0\n' >mm.nc
printf 'G20 G90\nG0 X0 Y0\nG1 X1.\nG1 Y1.\nG1 X0\nG1 Y0\n' >inch.nc
tr -d ' ' <mm.nc >mm-without-blanks.nc
tr -d ' ' <inch.nc >inch-without-blanks.nc
cat >run.py <<'PYTHON'
import FreeCAD
import Path
import PathScripts.PathJob as PathJob
import PathScripts.post.gcode_pre as importer

seen = []
for name in ("mm", "inch", "mm-without-blanks", "inch-without-blanks"):
    document = FreeCAD.newDocument("square")
    box = document.addObject("Part::Box", "Box")
    document.recompute()
    job = PathJob.Create("Job", [box], None)
    importer.insert(name + ".nc", document.Name)
    document.recompute()
    widths = [round(each.Path.BoundBox.XLength, 3) for each in job.Operations.Group]
    seen.append(name + ": " + (", ".join(map(str, widths)) or "no operation"))
    FreeCAD.closeDocument(document.Name)
with open("inch.nc") as file:
    seen.append("inch, Path.Path: " + str(round(Path.Path(file.read()).BoundBox.XLength, 3)))
with open("seen", "w") as file:
    file.write("\n".join(seen) + "\n")
PYTHON
HOME=$folder freecadcmd run.py >log 2>&1 </dev/null || true
echo "expected: each 25.4 mm wide"
sed 's/^/seen, mm wide, /' seen
printf 'mm: 25.4\ninch: 1.0\nmm-without-blanks: no operation\ninch-without-blanks: no operation\ninch, Path.Path: 25.4\n' >stated
if cmp -s seen stated; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
