"""Print estimated powers beside measured ones, of each axis moving alone.

Usage: python tests/benchmarks/estimates.py [--feed 1000]

*ratio*: measured over estimated power; *band*: within which an estimate says that it lies.
"""

import argparse

import numpy as np

import fiveaxis as fx
from fiveaxis.model import Machine, with_powers
from fiveaxis.model.energy.drives import axis_powers

ROW = "{:18} {:5} {:>10} {:>10} {:>8}   {}"


def powers(machine: Machine, feed: float) -> np.ndarray:
    """Power of each axis alone while its value grows and while it falls, (2, k) W."""
    rotary = np.array([axis.is_rotary for axis in machine.axes])
    speed = np.where(rotary, np.radians(feed), feed) / 60.0
    every = np.concatenate([np.diag(speed), -np.diag(speed)])
    found = axis_powers(machine, np.zeros_like(every), every)
    return np.diagonal(found.reshape(2, len(speed), -1), axis1=1, axis2=2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--feed", type=float, default=1000.0, help="mm/min and deg/min")
    given = parser.parse_args()
    print(ROW.format("machine", "axis", "measured W", "estimate W", "ratio", "band"))
    for name in ("hayashi-640123", "takisawa-mac-v3"):
        measured = fx.load_machine(name)
        estimated = with_powers(measured, "estimated")
        own, guessed = powers(measured, given.feed), powers(estimated, given.feed)
        for column, letter in enumerate(measured.letters):
            low, high = estimated.bands[letter]
            for side, sign in enumerate("+-"):
                pair = own[side, column], guessed[side, column]
                figures = (f"{watt:.1f}" for watt in pair)
                band = f"{low:.3g} to {high:g}"
                print(ROW.format(name, letter + sign, *figures, f"{pair[0] / pair[1]:.2f}", band))


if __name__ == "__main__":
    main()
