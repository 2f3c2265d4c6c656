"""The same inputs give the same bytes, in every process and on every processor.

Of processors, that is x86-64 with fused multiply-add, so since 2013: kernels of linear algebra and vector
code are what a processor is asked for, and are chosen here by hand, as on other processors. Processes differ
in the hashes of texts, and with them in the order of sets.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
# README's example, whose refinement tells the last digit of any number; and the axes of a head about a torus.
PROGRAM = """
from hashlib import sha256
import numpy as np
import fiveaxis as fx
from fiveaxis.nc.program import compose_program

def tell(solution, machine):
    lines = compose_program(solution.motion, machine=machine, control="linuxcnc").lines
    print(sha256("\\n".join(lines).encode()).hexdigest(), solution.energy.total.hex())

part, machine = "examples/overhang/part.stl", fx.load_machine("hayashi-640123")
path = fx.plan_contour(part, fx.Tool.ball(8), stepdown=3, overhang=True)
print(sha256(path.contact.tobytes() + path.normal.tobytes()).hexdigest())
tell(fx.optimise(path, machine, tilt=(15, 75), part=part, effort="quick"), machine)

machine = fx.load_machine("linuxcnc-bridgemill").with_tool_length(80.0)
turn = np.linspace(0.0, 1.5 * np.pi, 40)
out = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
wall = fx.Toolpath.from_contacts(15.0 * out, 0.8 * out + [0.0, 0.0, 0.6], fx.Tool.bull(8, 1))
# The wall stands where the machine has its own bodies.
tell(fx.optimise(wall, machine, tilt=(10, 60), effort="quick", keep_clear=False), machine)
"""
VECTOR_CODE = " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
# An old processor's linear algebra, without numpy's vector code.
KERNELS = {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": VECTOR_CODE}


def told(**environment: str) -> str:
    """What the program tells under environment variables."""
    ran = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROGRAM],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@pytest.mark.slow
def test_other_kernels_give_the_same_program():
    assert told(**KERNELS) == told()


# What commands write: postures, report, pages and program of a job with bodies about it; a program that is
# revised in place; passes.
BODIES = "--machine examples/overhang/machine.toml --tool examples/overhang/ball-8.toml --tool-length 85"
COMMANDS = {
    "bodies": f"optimise examples/overhang/coarse.toml {BODIES} --drives hayashi-640123 --json",
    "revised": "optimise examples/bracket.nc --machine dmu50ev --cone 20 --operation 3 --effort quick --json",
    "raster": "plan examples/overhang/part.stl --tool ball:8 --strategy raster --stepover 8 --order islands",
}


@pytest.mark.slow
@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_another_process_writes_the_same_bytes(words, tmp_path):
    def written(seed: str) -> dict[str, bytes]:
        folder = tmp_path / seed
        folder.mkdir()
        out = folder / ("path.csv" if words.startswith("plan") else "out")
        ran = subprocess.run(
            [sys.executable, "-m", "fiveaxis.cli", *words.split(), "-o", str(out)],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=False,
        )
        assert ran.returncode in (0, 1), ran.stderr.decode()
        files = [file for file in folder.rglob("*") if file.is_file()]
        return {str(file.relative_to(folder)): file.read_bytes() for file in files} | {"": ran.stdout}

    first = written("1")
    assert len(first) > 1
    assert written("2") == first
