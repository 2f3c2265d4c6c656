#!/bin/sh
# A jerk-limited move jumps in its middle, and one that is too short to brake in ends twice as far.
#
# Run: InterpolatePy 3.3.2 (PyPI), DoubleSTrajectory at 50 mm/s, 500 mm/s2 and 5000 mm/s3, read once
# a millisecond as a servo would.
#
# Guess before the run: the places that a jerk-limited profile gives never ask for more than its
# bounds, and begin and end as stated; what can't be done within them is refused.
#
# What happens: the duration is rounded to milliseconds, and the second half is counted back from it, so
# that the halves don't meet: 5 mm from rest to rest jump by 0.013 mm, at 26 times the acceleration. The
# speeds and accelerations that it reports are smooth and within the bounds. From 50 mm/s to rest within
# 1 mm, where braking takes 5, it gives 2 mm at 50 mm/s throughout; from rest to 50 mm/s within 1 mm it
# stands still. Nothing is raised. A duration of whole milliseconds has no jump.
#
# Why it matters: an axis that is fed these places gets a knock in each move, and the plots of speed and
# acceleration show nothing. A move that must end before a clamp goes through it. Differentiate the
# places, and compare both ends with what was asked.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check interpolatepy==3.3.2 numpy==2.4.6 \
    scipy==1.17.1 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from importlib.metadata import version

from interpolatepy import DoubleSTrajectory, StateParams, TrajectoryBounds

SPEED, ACCELERATION, JERK = 50.0, 500.0, 5000.0  # mm, s
CYCLE = 0.001
# Distance, speed at its start and end: where it ends, how fast, highest acceleration by places, as reported.
CASES = {
    (5.0, 0.0, 0.0): (5.0, 0.0, 13000, 253),
    (10.0, 0.0, 0.0): (10.0, 0.0, 500, 500),
    (10.0, 50.0, 0.0): (10.0, 0.0, 500, 500),
    (1.0, 50.0, 0.0): (2.0, 50.0, 0, 0),
    (1.0, 0.0, 50.0): (0.0, 0.0, 0, 0),
}

print("InterpolatePy", version("interpolatepy"))
print(f"expected: the end as asked, at most {ACCELERATION:g} mm/s2, or an error")
as_stated = True
for (distance, start, end), stated in CASES.items():
    bounds = TrajectoryBounds(v_bound=SPEED, a_bound=ACCELERATION, j_bound=JERK)
    move = DoubleSTrajectory(StateParams(q_0=0.0, q_1=distance, v_0=start, v_1=end), bounds)
    duration = move.get_duration()
    times = [i * CYCLE for i in range(round(duration / CYCLE) + 1)]
    places = [float(move.evaluate(time)) for time in times]
    steps = [b - a for a, b in zip(places, places[1:])]
    asked = max(abs(b - a) for a, b in zip(steps, steps[1:])) / CYCLE**2
    told = max(abs(float(move.evaluate_acceleration(time))) for time in times)
    last, speed = places[-1], float(move.evaluate_velocity(duration))
    print(
        f"seen, {distance:g} mm from {start:g} to {end:g} mm/s: to {last:.3f} mm in {duration:.3f} s, at"
        f" {speed:.1f} mm/s; {asked:.0f} mm/s2 by its places, {told:.0f} as reported"
    )
    near = all(abs(a - b) <= 0.02 * abs(b) + 0.001 for a, b in zip((last, speed, asked, told), stated))
    as_stated &= near
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
