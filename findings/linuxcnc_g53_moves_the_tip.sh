#!/bin/sh
# LinuxCNC's G53 G0 Z100 moves Y instead of Z, and through the part, where its table is tilted by 90 degrees.
#
# Run: the control of Debian 12's linuxcnc-uspace 2.9.0~pre1, with its kinematics xyzac-trt-kins as they
# are at its start, and simulated joints whose positions are recorded every millisecond.
#
# Guess before the run: G53 is in machine coordinates, so it moves the joint of Z to 100 and no other, as
# G53 and SUPA do on Fanuc, Haas and Sinumerik, tool centre point control or not.
#
# What happens: under tool centre point control G53 means the tip's coordinates on the part, without
# offsets. With A at 90 the part's Z lies along the machine's Y: the joint of Y goes from 30 to -100, and
# that of Z stays at 10. At A0 it is as guessed. There is no message.
#
# Why it matters: G53 G0 Z is how programs retract, before a tool change and at their end. Where the table
# is tilted, the tool is dragged sideways at rapid instead. These kinematics start so, unless the INI says
# identityfirst; then the first G53 is meant as well, after an abort. Switch to identity (M429, where it is
# configured) before each G53.
#
# Exit: 0 as described, 1 it has changed, 2 another or no linuxcnc-uspace is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' linuxcnc-uspace) || exit 2
echo "linuxcnc-uspace $version"
[ "$version" = "2.9.0~pre1+git20230208.f1270d6ed7-1+deb12u2" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
chmod 1777 "$folder"
cd "$folder"
export HOME="$folder" RTAPI_FIFO_PATH="$folder/fifo"
[ "$(id -u)" != 0 ] || export RTAPI_UID=65534
{
    printf '[EMC]\nVERSION=1.1\n[DISPLAY]\nDISPLAY=./run.py\n[TASK]\nTASK=milltask\nCYCLE_TIME=0.001\n'
    printf '[RS274NGC]\nPARAMETER_FILE=machine.var\n[EMCMOT]\nEMCMOT=motmod\nCOMM_TIMEOUT=4\n'
    printf '[HAL]\nHALFILE=machine.hal\n[EMCIO]\nEMCIO=io\nTOOL_TABLE=tool.tbl\n'
    printf '[KINS]\nKINEMATICS=xyzac-trt-kins\nJOINTS=5\n'
    printf '[TRAJ]\nCOORDINATES=X Y Z A C\nLINEAR_UNITS=mm\nANGULAR_UNITS=degree\n'
    printf 'MAX_LINEAR_VELOCITY=90\nMAX_LINEAR_ACCELERATION=500\n'
    for axis in X:0:LINEAR:90 Y:1:LINEAR:90 Z:2:LINEAR:90 A:3:ANGULAR:90 C:4:ANGULAR:90; do
        IFS=: read -r letter joint type speed <<LINE
$axis
LINE
        for section in "AXIS_$letter" "JOINT_$joint"; do
            printf '[%s]\nTYPE=%s\nMAX_VELOCITY=%s\n' "$section" "$type" "$speed"
            printf 'MAX_ACCELERATION=500\nFERROR=1000\nMIN_FERROR=1000\nMIN_LIMIT=-1000\nMAX_LIMIT=1000\n'
            printf 'HOME_SEQUENCE=0\nHOME_SEARCH_VEL=0\nHOME_LATCH_VEL=0\n'
        done
    done
} >machine.ini
{
    echo 'loadrt [KINS]KINEMATICS'
    echo 'loadrt motmod servo_period_nsec=1000000 num_joints=5'
    echo 'loadrt sampler depth=60000 cfg=fffff'
    printf 'addf %s servo-thread\n' motion-command-handler motion-controller sampler.0
    for joint in 0 1 2 3 4; do
        echo "net j$joint joint.$joint.motor-pos-cmd => joint.$joint.motor-pos-fb sampler.0.pin.$joint"
    done
    echo 'net enable iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in'
} >machine.hal
echo 'T1 P1' >tool.tbl
: >machine.var
for angle in 0 90; do
    printf 'G21 G90 G94\nG0 X20 Y10 Z-30 A%s C0\nG4 P0.5\nG53 G0 Z100\nM2\n' $angle >A$angle.ngc
done
cat >run.py <<'PYTHON'
#!/usr/bin/python3
import pathlib
import subprocess
import time

import linuxcnc

command, status = linuxcnc.command(), linuxcnc.stat()


def wait_for(condition):
    end = time.monotonic() + 60
    status.poll()
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
        status.poll()


for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
    command.state(state)
    command.wait_complete()
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.home(-1)
wait_for(lambda: all(status.homed[:5]))
command.teleop_enable(1)
command.wait_complete()
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
for program in sorted(pathlib.Path().glob("*.ngc")):
    with program.with_suffix(".txt").open("w") as file:
        sampler = subprocess.Popen(["halsampler"], stdout=file)
        command.program_open(str(program.resolve()))
        command.wait_complete()
        command.auto(linuxcnc.AUTO_RUN, 0)
        time.sleep(0.5)
        wait_for(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and not status.queue)
        time.sleep(0.5)
        sampler.terminate()
        sampler.wait()
PYTHON
chmod +x run.py
timeout 180 linuxcnc machine.ini >log 2>&1 </dev/null || true
python3 - <<'PYTHON'
import pathlib
import sys

print("expected: G53 G0 Z100 moves Z to 100, and neither X nor Y")
seen = {}
for name in ("A0", "A90"):
    lines = pathlib.Path(f"{name}.txt").read_text().splitlines()
    rows = [line.split()[:3] for line in lines if "over" not in line]
    places = [tuple(round(float(word), 3) for word in row) for row in rows]
    # Where the joints rest longest before they go on to their last place: in the dwell.
    before = max(set(places) - {places[0], places[-1]}, key=places.count)
    seen[name] = (before, places[-1])
    print(f"seen at {name}: X, Y and Z from {before} to {places[-1]}")
stated = {"A0": ((20.0, 10.0, -30.0), (20.0, 10.0, 100.0)), "A90": ((20.0, 30.0, 10.0), (20.0, -100.0, 10.0))}
print("as stated" if seen == stated else "CHANGED")
sys.exit(seen != stated)
PYTHON
