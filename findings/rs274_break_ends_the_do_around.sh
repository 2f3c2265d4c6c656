#!/bin/sh
# LinuxCNC's interpreter leaves a do loop at its first turn after a break in a while loop inside it.
#
# Run: rs274 of Debian 12's linuxcnc-uspace 2.9.0~pre1.
#
# Guess before the run: break ends the loop of the number that it names. Three turns of a do loop,
# with a while inside that breaks in each, cut three times, as the same program with repeat does.
#
# What happens: the break ends the while, the lines after it run, and then "o1 while" at the foot of
# the do doesn't go back, although its condition holds. The rest of the program runs to its
# end: two of three passes are missing, without an error. With repeat or while as the outer loop
# all three are cut.
#
# Why it matters: a macro that steps down in a do loop and looks for something in a while
# inside stops at its first depth. Nobody sees it before the part is measured. Write the outer
# loop as repeat or while.
#
# Exit: 0 as described, 1 it has changed, 2 another or no linuxcnc-uspace is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' linuxcnc-uspace) || exit 2
echo "linuxcnc-uspace $version"
[ "$version" = "2.9.0~pre1+git20230208.f1270d6ed7-1+deb12u2" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
passes() {
    printf 'G21 G90 G94 F100\n#1 = 0\n%s\n#1 = [#1 + 1]\n#2 = 0\n' "$1"
    printf 'o3 while [#2 LT 5]\n#2 = [#2 + 1]\no4 if [#2 EQ 2]\no3 break\no4 endif\no3 endwhile\n'
    printf 'G1 X#1\n%s\nM2\n' "$2"
}
passes 'o1 do' 'o1 while [#1 LT 3]' >do.ngc
passes 'o1 repeat [3]' 'o1 endrepeat' >repeat.ngc
echo "expected of both: X1, X2 and X3"
for name in do repeat; do
    HOME=$folder rs274 -g $name.ngc | grep -oE 'STRAIGHT_FEED\([0-9.]+' | tr -d 'A-Z_(' >$name.seen
    echo "seen, $name: $(tr '\n' ' ' <$name.seen)"
done
if [ "$(cat do.seen)" = "1.0000" ] && [ "$(wc -l <repeat.seen)" -eq 3 ]; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
