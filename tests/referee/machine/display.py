#!/usr/bin/python3
"""What LinuxCNC starts as its display: homes the machine, runs one program, and writes down how it went.

Runs under the system's Python, where the package puts the module `linuxcnc`; its environment says what to do:
PROGRAM, SAMPLES, VERDICT (files) and LIMIT (s).
"""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import linuxcnc

JOINTS = 5
# s: homing takes no motion, and starting a program none to speak of.
SOON, POLL = 60.0, 0.005
FAULTS = (linuxcnc.OPERATOR_ERROR, linuxcnc.NML_ERROR)

status, command, errors = linuxcnc.stat(), linuxcnc.command(), linuxcnc.error_channel()
messages = []


def collect():
    while message := errors.poll():
        messages.append(message)


def wait(condition, seconds):
    """Poll until a condition holds; tell whether it did, or a fault came first."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        status.poll()
        collect()
        if condition():
            return True
        if any(kind in FAULTS for kind, _ in messages):
            return False
        time.sleep(POLL)
    messages.append((linuxcnc.NML_ERROR, f"not done after {seconds:g} s"))
    return False


def switch_on():
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete()
    command.state(linuxcnc.STATE_ON)
    command.wait_complete()
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    return wait(lambda: sum(status.homed[:JOINTS]) == JOINTS, SOON)


def run(program, seconds):
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(program)
    command.wait_complete()
    command.auto(linuxcnc.AUTO_RUN, 0)
    return wait(lambda: status.interp_state != linuxcnc.INTERP_IDLE, SOON) and wait(
        lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.queue == 0, seconds
    )


with Path(os.environ["SAMPLES"]).open("w") as samples:
    sampler = subprocess.Popen(["halsampler", "-t"], stdout=samples)
    time.sleep(0.2)
    done = switch_on() and run(os.environ["PROGRAM"], float(os.environ["LIMIT"]))
    time.sleep(0.2)
    sampler.send_signal(signal.SIGTERM)
    sampler.wait()
collect()
faults = [text for kind, text in messages if kind in FAULTS]
Path(os.environ["VERDICT"]).write_text(json.dumps({"done": done, "faults": faults}))
