"""From the STEP file of an impeller to passes along its blades: seconds and memory of one command.

usage: python tests/benchmarks/impeller.py [BLADES ...]

5 blades are 48 faces, 24 are 219. *read* is the time of `fiveaxis info`, start of Python and Open Cascade
included; *planned* that of `fiveaxis plan` of passes along the faces of one blade, both in processor seconds
of all processes, too, which other work on the computer lengthens less. Memory is that of the largest process.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MAKER = Path(__file__).parents[1] / "support/cad_parts.py"
ROW = "{:>6} {:>6} {:>8} {:>16} {:>16} {:>10}"


def run(*words: str) -> tuple[str, dict[str, object]]:
    begun, before = time.perf_counter(), used()
    done = subprocess.run(
        [sys.executable, "-m", "fiveaxis.cli", *words, "--json"], check=True, capture_output=True
    )
    return f"{time.perf_counter() - begun:.1f} ({used() - before:.1f})", json.loads(done.stdout)


def used() -> float:
    """Processor seconds of all processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    print(ROW.format("blades", "faces", "MB file", "read s (CPU)", "planned s (CPU)", "memory MB"))
    for blades in [int(word) for word in sys.argv[1:]] or [5, 24]:
        with tempfile.TemporaryDirectory() as folder:
            part = Path(folder) / "impeller.step"
            make = [sys.executable, str(MAKER), "impeller", str(part), str(blades)]
            subprocess.run(make, check=True, capture_output=True)
            read, told = run("info", str(part))
            splines = [face["number"] for face in told["faces"] if face["kind"] == "spline"][:8]
            chosen = ",".join(map(str, splines))
            planned, _ = run(
                *("plan", str(part), "--tool", "ball:4", "--strategy", "flow", "--faces", chosen),
                *("--scallop", "0.02", "-o", str(part.with_suffix(".csv"))),
            )
            peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            size = part.stat().st_size / 1e6
            row = blades, len(told["faces"]), f"{size:.1f}", read, planned, f"{peak:.0f}"
            print(ROW.format(*row), flush=True)


if __name__ == "__main__":
    main()
