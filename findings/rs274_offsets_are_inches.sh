#!/bin/sh
# LinuxCNC's stand-alone interpreter takes the tool table and the work offsets of a metric machine
# for inches.
#
# Run: rs274 of Debian 12's linuxcnc-uspace 2.9.0~pre1, with the machine's own INI file,
# tool table and parameter file, once with LINEAR_UNITS = mm in the INI file and once with inch.
#
# Guess before the run, for the parameter file: G54's X of 7 is 7 mm where LINEAR_UNITS is mm. The
# tool table had been seen to be read as inches, with an INI file given, when that was written.
#
# What happens: LINEAR_UNITS isn't looked at. A tool of length 100 and a G54 of 7 are applied as
# 2540 mm and 177.8 mm in a G21 program, while the parameters #5403 and #5221 still say 100 and 7,
# so a program that prints them looks right. The program's own moves are in mm.
#
# Why it matters: rs274 is how programs are tried without a control. G53 moves, and all that
# is worked out from its output with an offset in it, come out with 25.4 times that offset, and a
# metric control with the same files does otherwise. Its manual page doesn't name a unit;
# LinuxCNC's issue 1279, closed, does. Try metric programs with length 0 and no work offset, or divide
# the copies of both files by 25.4.
#
# Exit: 0 as described, 1 it has changed, 2 another or no linuxcnc-uspace is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' linuxcnc-uspace) || exit 2
echo "linuxcnc-uspace $version"
[ "$version" = "2.9.0~pre1+git20230208.f1270d6ed7-1+deb12u2" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo "T1 P1 Z100 D10" >tool.tbl
printf 'G21 G90\nT1 M6\nG43\nG53 G0 Z0\nG0 Z10\n(debug,#5403 #5221)\nM2\n' >part.ngc
echo "expected with mm: tool 100 mm, G54 X 7 mm, G53 Z0 is Z-100; with inch, 25.4 times that"
for unit in mm inch; do
    printf '[EMC]\nVERSION=1.1\n[KINS]\nJOINTS=3\n[TRAJ]\nCOORDINATES=XYZ\nLINEAR_UNITS=%s\n' \
        $unit >machine.ini
    printf '[EMCIO]\nTOOL_TABLE=tool.tbl\n[RS274NGC]\nPARAMETER_FILE=machine.var\n' >>machine.ini
    printf '5161\t0\n5162\t0\n5220\t1\n5221\t7\n5222\t0\n' >machine.var
    rs274 -i machine.ini -t tool.tbl -v machine.var -g part.ngc >$unit.txt 2>&1 || true
    grep -E '^ +[0-9]+ N\.+ (SET_G5X_OFFSET|USE_TOOL_LENGTH|STRAIGHT_TRAVERSE|MESSAGE)' \
        $unit.txt | sed 's/^ *[0-9]* N\.* //' | uniq >$unit.seen
    sed "s/^/seen, LINEAR_UNITS=$unit: /" $unit.seen
done
if cmp -s mm.seen inch.seen &&
    grep -q '^SET_G5X_OFFSET(1, 177.8000,' mm.seen &&
    grep -q '^USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 2540.0000,' mm.seen &&
    grep -q '^STRAIGHT_TRAVERSE(.*, -2540.0000, 0.0000, 0.0000, 0.0000)' mm.seen &&
    grep -q '^MESSAGE("100.000000 7.000000")' mm.seen; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
