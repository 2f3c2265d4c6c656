#!/bin/sh
# LinuxCNC doesn't look into the second section of one name in an INI file.
#
# Run: inivar of Debian 12's linuxcnc-uspace 2.9.0~pre1, which looks things up as the control does.
#
# Guess before the run: sections of one name are joined, and the last value of a key holds, as
# with Git's, systemd's and most other INI files; or the second one is refused.
#
# What happens: only the first section of a name is looked at. A limit that the second one
# narrows stays as wide as in the first, and a key that only the second one has is "not found", so
# the control takes its default: no lower limit at all.
#
# Why it matters: configurations are put together from pieces, and a piece for the axis at
# the end of the file looks as if it narrowed the travel. Whoever reads the file with another INI reader
# computes with limits that the machine doesn't have. Keep one section of a name.
#
# Exit: 0 as described, 1 it has changed, 2 another or no linuxcnc-uspace is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' linuxcnc-uspace) || exit 2
echo "linuxcnc-uspace $version"
[ "$version" = "2.9.0~pre1+git20230208.f1270d6ed7-1+deb12u2" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
printf '[AXIS_Z]\nMAX_LIMIT = 120\n[AXIS_X]\nMAX_LIMIT = 5\n' >machine.ini
printf '[AXIS_Z]\nMAX_LIMIT = 60\nMIN_LIMIT = -10\n' >>machine.ini
echo "expected: Z from -10 to 60"
high=$(inivar -ini machine.ini -sec AXIS_Z -var MAX_LIMIT)
low=$(inivar -ini machine.ini -sec AXIS_Z -var MIN_LIMIT 2>/dev/null) || low="not found"
echo "seen: Z from $low to $high"
if [ "$high" = 120 ] && [ "$low" = "not found" ]; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
