"""Runs a script on a case with tesseract's Python wheel, in an environment of its own."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import venv
from pathlib import Path

import numpy as np
from case import Case

from fiveaxis.base.errors import NoBaseline
from fiveaxis.posture.baselines.catalogue import along_normal, lead_lean

# Environment variable with a folder of newer system libraries for the wheel.
LIBRARIES = "FIVEAXIS_PEERS_LIBRARIES"


class CannotDoError(Exception):
    """Why a method can't do a case."""


def by_tesseract(script: str, case: Case, seconds: float) -> list:
    """Run a script with the Python of an environment that has tesseract's wheel."""
    command, variables = interpreter("tesseract-robotics-nanobind==0.35.0.8")
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder) / "problem.json", Path(folder) / "result.json"
        given.write_text(json.dumps(described(case) | {"seconds": seconds}), encoding="utf-8")
        whole = [*command, Path(__file__).with_name(script), given, found]
        run = subprocess.run(whole, capture_output=True, text=True, check=False, env=variables)
        if not found.exists():
            raise CannotDoError(reason(run.stderr))
        return json.loads(found.read_text(encoding="utf-8"))


def reason(said: str) -> str:
    """Last line of what a script said in the end; the wheel's own reports of leaks aren't meant."""
    if "GLIBCXX_" in said or "CXXABI_" in said:
        return f"its wheel needs a newer C++ library, which {LIBRARIES} can name"
    lines = [line for line in said.strip().splitlines() if "nanobind" not in line and "leaked" not in line]
    return lines[-1] if lines else "it ended without a word"


def described(case: Case) -> dict:
    """Describe a case for a script without the package: chain, locations, prices and bounds in its order."""
    machine, chain, problem = case.machine, case.machine.chain, case.problem
    home, joints = chain.tool_home, []
    if not np.allclose(home[:3, 2], (0.0, 0.0, 1.0)):
        raise CannotDoError("written for a tool along Z at home")
    order = [machine.column(joint.letter) for joint in chain.joints]
    for joint, column in zip(chain.joints, order, strict=True):
        limits = machine.axes[column].limits
        joints.append(
            {
                "name": joint.letter,
                "kind": "revolute" if joint.is_rotary else "prismatic",
                "point": list(map(float, joint.line.point)) if joint.is_rotary else [0.0, 0.0, 0.0],
                "direction": list(map(float, joint.line.direction)),
                "limits": [float(limits.low), float(limits.high)],
            }
        )
    starts = [along_normal(case.toolpath, machine, case.tilt)]
    with contextlib.suppress(NoBaseline):
        starts.append(lead_lean(case.toolpath, machine, case.tilt))
    count = len(case.toolpath)
    leans = [
        {
            "reference": bound.reference.tolist(),
            "low": np.broadcast_to(bound.low, count).tolist(),
            "high": np.broadcast_to(bound.high, count).tolist(),
        }
        for bound in case.tilt.all
    ]
    return {
        "joints": joints,
        "centre": (home[:3, 3] + case.toolpath.zone.height * home[:3, 2]).tolist(),
        "points": case.toolpath.pivot.tolist(),
        "leans": leans,
        "plus": problem.plus[:, order].tolist(),
        "minus": problem.minus[:, order].tolist(),
        "turns": np.where(problem.strict[:, None], problem.max_turn, np.inf).tolist(),
        "starts": [start.tolist() for start in starts],
    }


def interpreter(package: str) -> tuple[list[str | Path], dict[str, str]]:
    """Start of a command, for the Python of an environment that has a package, and its variables.

    The wheel needs the C++ library of GCC 14, as Ubuntu 24.04 and Debian 13 have it. On an older system the
    variable `LIBRARIES` names a folder with a newer one's libstdc++6, libgcc-s1 and libc6, unpacked: its
    loader starts the Python.
    """
    python, variables = environment(package), dict(os.environ)
    folder = os.environ.get(LIBRARIES)
    if folder is None:
        return [python], variables
    packages = next(python.parents[1].glob("lib/python*/site-packages"))
    loader = [Path(folder) / "ld-linux-x86-64.so.2", "--library-path", folder]
    return [*loader, python.resolve()], variables | {"PYTHONPATH": str(packages)}


def environments() -> Path:
    """Folder of all environments."""
    return Path(tempfile.gettempdir()) / "fiveaxis-peers-environments"


def environment(package: str) -> Path:
    """Python of an environment that has a package; made at first use."""
    folder = environments() / package.replace("==", "-")
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        made = subprocess.run(
            [python, "-m", "pip", "install", "-q", package], capture_output=True, text=True, check=False
        )
        if made.returncode != 0:
            shutil.rmtree(folder)
            raise CannotDoError(f"{package} can't be installed: {made.stderr.strip().splitlines()[-1]}")
    return python
