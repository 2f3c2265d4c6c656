#!/bin/sh
# LinuxCNC runs an inverse-time block sooner than it asks for where X, Y and Z creep.
#
# Run: rs274 of Debian 12's linuxcnc-uspace 2.9.0~pre1, the interpreter that the control uses.
#
# Guess before the run: a block under G93 with F1 takes one minute, whatever moves in it; that is what inverse
# time is for where rotary and linear axes move together.
#
# What happens: the time is turned into a feed along X, Y and Z alone, and that feed is raised to 0.1 per
# minute. A block that turns C by 90 degrees and moves X by 0.001 mm in one minute gets a feed of 0.1 mm/min:
# it is done in 0.6 s, and C turns 100 times as fast as asked. With 0.2 mm of X the minute is kept.
#
# Why it matters: beside the singular direction, or where a table turns about the contact, linear axes creep
# while a rotary one turns. There the tool is faster than the program says, and nothing is told. Give such a
# block no linear word, so that the feed is in degrees, or at least 0.1 mm for each minute.
#
# Exit: 0 as described, 1 it has changed, 2 another or no linuxcnc-uspace is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' linuxcnc-uspace) || exit 2
echo "linuxcnc-uspace $version"
[ "$version" = "2.9.0~pre1+git20230208.f1270d6ed7-1+deb12u2" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
printf 'G21 G90\nG93\nG1 X0.001 C90 F1\nG1 X0.201 C180 F1\nM2\n' >swing.ngc
echo "expected: feeds along X of 0.001 and 0.2 mm/min, one minute each"
HOME=$folder rs274 -g swing.ngc | grep -oE 'SET_FEED_RATE\([0-9.]+' | tr -d 'A-Z_(' | head -n 2 >seen
echo "seen: $(tr '\n' ' ' <seen)mm/min"
if [ "$(tr '\n' ' ' <seen)" = "0.1000 0.2000 " ]; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
