"""Look at what a posture costs at one cutter location: the power surface over the two rotary angles.

Where the rotary axes stand decides where the linear axes must be to hold the tip in place, and each axis pays
its own price per millimetre or degree, up and down not the same. The surface is the consumption of the move
from the axes' zero, split into the linear and the rotary part. Its valleys tell where cheap postures lie and
its range how much there is to win; only the difference between postures matters, not the height itself.
"""

from __future__ import annotations

import numpy as np

import fiveaxis as fx

TIP = (30.0, 10.0, 20.0)  # mm, workpiece frame
FEED = 1000.0  # mm/min


def main() -> None:
    machine = fx.load_machine("hayashi-640123")
    grid = (np.radians(np.arange(-180.0, 180.0, 5.0)), np.radians(np.arange(-90.0, 91.0, 5.0)))
    surface = fx.power_surface(machine, TIP, FEED, grid)
    first, second = surface.letters
    for name, part in (("linear", surface.linear), ("rotary", surface.rotary), ("total", surface.total)):
        print(f"{name}: {part.min():.1f} to {part.max():.1f} J")
    for word, place in (("cheapest", surface.total.argmin()), ("dearest", surface.total.argmax())):
        row, column = np.unravel_index(place, surface.total.shape)
        angles = np.degrees([surface.first[row], surface.second[column]])
        print(f"{word}: {first} {angles[0]:+.0f} deg, {second} {angles[1]:+.0f} deg")
    tilted = np.abs(np.degrees(surface.second) - 30.0).argmin()
    around = surface.total[:, tilted]
    print(f"{second} held at 30 deg, {first} alone: {around.min():.1f} to {around.max():.1f} J")


if __name__ == "__main__":
    main()
