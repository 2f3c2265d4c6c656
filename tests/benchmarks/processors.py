"""Optimise the cases on record as on other processors, and hold the programs' text to each other.

Usage: python tests/benchmarks/processors.py [vase] [wall] [example] [dome-top] … [--effort quick]

Kernels of linear algebra are chosen by hand, also without numpy's vector code; compiled loops are made from
what every processor has, and from all that this one has, fused multiply-add included. A line for each case
and setting: the energy to the last digit, and whether the program is the same, byte for byte. Another program
ends in exit code 1.
"""

import argparse
import os
import subprocess
import sys
from hashlib import sha256

import numpy as np
from llvmlite import binding
from paths import PATHS

import fiveaxis as fx
from fiveaxis.nc.program import compose_program

CASES = ("vase", "wall", "example", "dome-top")
VECTOR_CODE = " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
KERNELS = ("Prescott", "Nehalem", "Haswell", "Zen")


def settings() -> dict[str, dict[str, str]]:
    """Environment variables that stand for a processor, by its name."""
    return {
        "this one": {},
        **{f"{name} kernels": {"OPENBLAS_CORETYPE": name} for name in KERNELS},
        "no vector code": {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": VECTOR_CODE},
        "all its instructions": {
            "NUMBA_CPU_NAME": binding.get_host_cpu_name(),
            "NUMBA_CPU_FEATURES": binding.get_host_cpu_features().flatten(),
        },
    }


def tell(name: str, effort: str) -> None:
    """Print a case's energy, J, and a digest of its program."""
    case = PATHS[name]
    path, machine = case.make()
    solution = fx.optimise(path, machine, **{**case.options, "effort": effort})
    lines = compose_program(solution.motion, machine=machine, control="linuxcnc").lines
    print(f"{solution.energy.total!r} {sha256(chr(10).join(lines).encode()).hexdigest()}")


def told(name: str, effort: str, environment: dict[str, str]) -> str:
    """Return what a process under environment variables prints of a case."""
    command = [sys.executable, __file__, "--tell", name, "--effort", effort]
    ran = subprocess.run(
        command, env={**os.environ, **environment}, stdout=subprocess.PIPE, text=True, check=True
    )
    return ran.stdout.strip()


def main() -> int:
    """Run all cases under all settings, and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=CASES)
    parser.add_argument("--effort", default="normal", choices=("quick", "normal", "thorough"))
    parser.add_argument("--tell", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.tell:
        tell(given.tell, given.effort)
        return 0
    others = 0
    for name in given.names:
        first = None
        for setting, environment in settings().items():
            joules, digest = found = told(name, given.effort, environment).split()
            first = first or found
            others += found != first
            print(
                f"{name:10} {setting:24} {joules:>20} J  {digest[:12]}  "
                f"{'the same' if found == first else 'ANOTHER PROGRAM'}",
                flush=True,
            )
    return 1 if others else 0


if __name__ == "__main__":
    sys.exit(main())
