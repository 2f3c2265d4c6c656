"""Optimise the posture of a path that is known point by point: a ring on the underside of a dome.

A ball that turns about its own centre leaves its contact where it is, so at every point the tool may lean by
15 to 75 degrees from the surface normal, in any direction. Going once round with the tool along the normal
makes every axis follow; the optimiser looks for angles along the whole ring that let the dear axes rest. What
is saved is quoted against baselines, and the lower bound says how much could be left at most.
"""

from __future__ import annotations

import numpy as np

import fiveaxis as fx
from fiveaxis.posture import bound_travel

RADIUS, BELOW, POINTS = 30.0, 25.0, 60  # mm, degrees below the equator, contact points
CENTRE = (40.0, 0.0, 30.0)  # mm, of the ball, beside the C axis


def ring() -> tuple[np.ndarray, np.ndarray]:
    """Give contacts (n, 3), mm, and normals (n, 3) of a circle on a ball of `RADIUS`."""
    around, down = np.linspace(0.0, 2.0 * np.pi, POINTS), np.radians(BELOW)
    level = np.full_like(around, -np.sin(down))
    normals = np.column_stack([np.cos(down) * np.cos(around), np.cos(down) * np.sin(around), level])
    return RADIUS * normals + CENTRE, normals


def main() -> None:
    machine = fx.load_machine("hayashi-640123")
    contacts, normals = ring()
    # The same from a table with the header x,y,z,nx,ny,nz: fx.read_toolpath("ring.csv", tool=tool).
    toolpath = fx.Toolpath.from_contacts(contacts, normals, fx.Tool.ball(8), feed_mm_min=1000)
    solution = fx.optimise(toolpath, machine, tilt=(15, 75), effort="quick")
    spent = solution.energy
    by_axis = ", ".join(f"{letter} {joules:.0f}" for letter, joules in spent.by_axis.items())
    print(f"{len(toolpath)} locations: {spent.total:.0f} J ({by_axis}) in {spent.time:.1f} s")
    for name, share in solution.savings().items():
        print(f"saved against {name}: {share:.1%}")
    # More work gives a higher bound; fx.optimise(…, bound=True) takes a minute for it.
    bound = bound_travel(solution.toolpath, machine, solution.tilt, work=6e8)
    print(f"travel metric {spent.travel:.0f} J; {bound.in_words(spent.travel)}")
    report = fx.verify(solution.motion, machine, toolpath, tilt=(15, 75))
    print(f"verified: {report.ok}, findings {dict(report.counts)}")


if __name__ == "__main__":
    main()
