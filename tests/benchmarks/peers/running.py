"""Run one method on one case in a process of its own, and print the result as JSON.

Usage: python tests/benchmarks/peers/running.py CASE METHOD
"""

from __future__ import annotations

import json
import resource
import sys
import time
from importlib.metadata import version
from typing import Any

from case import Case
from checker import violations
from methods import BOUND, METHODS, CannotDoError, axis_values

from fiveaxis.base.errors import FiveAxisError
from fiveaxis.model import USUAL_CLOCK, Filling, Interpolation, blocks_energy, follow
from fiveaxis.posture.bound.lower_bound import bound_travel

WHOSE = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def spent_so_far() -> float:
    """Processor time of this process and those that it waited for, s."""
    return sum(usage.ru_utime + usage.ru_stime for usage in map(resource.getrusage, WHOSE))


def spent_since(begun: float, wall: float) -> dict[str, float]:
    """Processor time, s, wall time, s, and the most memory, MB."""
    memory = max(resource.getrusage(whose).ru_maxrss for whose in WHOSE) / 1024.0
    return {"processor": spent_so_far() - begun, "seconds": time.perf_counter() - wall, "memory": memory}


def run(name: str, method: str) -> dict[str, Any]:
    """Run a method; all postures are priced and checked alike, as the program that they become.

    Returns
    -------
    ``energy`` and ``travel`` of the feed drives, J, and ``time``, s, of the program's blocks, as a control
    takes them that passes corners within 5 µm; processor and wall ``seconds`` of the method alone; ``memory``
    at most, MB; ``violations`` by kind; or ``why`` not. Of `BOUND` there is no program, but the travel metric
    that no posture is below.
    """
    case = Case.read(name)
    about = {"case": name, "method": method, "locations": len(case.toolpath), "fiveaxis": version("fiveaxis")}
    begun, wall = spent_so_far(), time.perf_counter()
    if method == BOUND:
        least = bound_travel(case.toolpath, case.machine, case.tilt, case.turns).total
        nothing = {"energy": None, "time": None, "violations": {}}
        return about | nothing | {"travel": least} | spent_since(begun, wall)
    try:
        postures = METHODS[method](case)
    except (CannotDoError, FiveAxisError) as error:
        return about | {"why": str(error).splitlines()[0]}
    spent = spent_since(begun, wall)
    path, rotary = postures
    filling = Filling.of(case.constraints, Interpolation.JOINT)
    blocks = filling.blocks(path, case.machine, follow(path, case.machine, rotary))
    energy = blocks_energy(case.machine, blocks, USUAL_CLOCK)
    return (
        about
        | spent
        | {
            "energy": energy.total,
            "travel": energy.travel,
            "time": energy.time,
            "blocks": len(blocks),
            "violations": violations(case, axis_values(case, postures)),
        }
    )


if __name__ == "__main__":
    print(json.dumps(run(sys.argv[1], sys.argv[2])))
