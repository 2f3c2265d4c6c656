"""Our answers about pairs of pieces beside coal's: wrong ones, differences of gaps and depths, and times.

Usage: python tests/benchmarks/pairs.py [POSES]
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.coal_query import PAIRS, SHAPES, CoalQuery, poses_of

from fiveaxis.base import Array
from fiveaxis.check.collision.pieces import PairQuery

# mm: nearer to a bound than this both answers are right; and the margin.
HAIR, MARGIN = 1e-6, 2.0


def timed(ask: Callable[[Array], float], poses: list[Array]) -> tuple[Array, float]:
    """Answers, and µs for each."""
    begin = time.process_time()
    answers = np.array([ask(pose) for pose in poses], dtype=float)
    return answers, 1e6 * (time.process_time() - begin) / len(poses)


def main(count: int) -> None:
    print(f"{count} poses a pair; mm; µs of ours / coal's: nearer than 0, nearer than {MARGIN:g}, depth")
    print("pair             wrong  gap off  too large  depth off      near 0      near 2         depth")
    for pair in PAIRS:
        (their_mover, mover), (their_other, other) = (SHAPES[name]() for name in pair.split("-"))
        theirs, ours = CoalQuery(their_mover, their_other), PairQuery(mover, other)
        poses = poses_of(theirs, mover.size + other.size, count)
        ours.depth(poses[0]), ours.nearer(poses[0], MARGIN)  # compiles
        gap = np.array([theirs.gap(pose, MARGIN) for pose in poses])
        off = np.array([ours.gap(pose, MARGIN) for pose in poses]) - gap
        found = {}
        for name, query in (("ours", ours), ("coal", theirs)):
            for margin in (0.0, MARGIN):
                found[name, margin] = timed(lambda pose, m=margin, q=query: q.nearer(pose, m), poses)
            found[name, "depth"] = timed(query.depth, poses)
        (depth, _), (known, _) = found["ours", "depth"], found["coal", "depth"]
        sure = {0.0: np.maximum(gap, known) > HAIR, MARGIN: np.abs(gap - MARGIN) > HAIR}
        wrong = sum(int(np.sum((found["ours", m][0] != found["coal", m][0]) & sure[m])) for m in sure)
        times = "  ".join(
            f"{found['ours', k][1]:5.1f} /{found['coal', k][1]:5.1f}" for k in (0.0, MARGIN, "depth")
        )
        # coal overstates the depth of two meshes in each other.
        deep = np.nan if mover.is_mesh and other.is_mesh else np.abs(depth - known).max()
        print(f"{pair:16} {wrong:5} {np.abs(off).max():8.1e} {off.max():10.1e} {deep:10.1e}  {times}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
