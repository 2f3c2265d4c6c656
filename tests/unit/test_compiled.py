"""Loops are compiled whatever calls them first, and where nothing can be kept."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fiveaxis

PACKAGE = Path(fiveaxis.__file__).parent
SCRIPT = """
import numpy as np
from fiveaxis.cam import TriangleTree
import fiveaxis.cam.mesh.kernels
print(TriangleTree.build(np.eye(3)[None]).distances(np.zeros((1, 3)))[0])
"""


LOOPS = """
import numpy as np
from fiveaxis.base import compiled, innermost

@compiled
def made(n):
    return np.ones(n)[0]

@innermost
def part(n):
    return made(n) + 1.0

@compiled
def whole(n):
    return part(n)
"""


def test_a_part_that_counts_no_references_may_be_the_first_to_call_a_loop_that_makes_an_array(tmp_path):
    (tmp_path / "loops.py").write_text(LOOPS)
    spec = importlib.util.spec_from_file_location("loops", tmp_path / "loops.py")
    loops = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loops)
    assert loops.whole(3) == 2.0


IN_FILES = """
import importlib.util, sys
for name in ("constant", "part", "whole"):
    spec = importlib.util.spec_from_file_location("fiveaxis." + name, name + ".py")
    module = sys.modules["fiveaxis." + name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
print(module.whole(1.0), sum(module.whole.stats.cache_hits.values()))
"""
FILES = {
    "constant": "ADDED = 10.0",
    "part": """
from fiveaxis.base import inner
from fiveaxis.constant import ADDED

@inner
def part(n):
    return n + ADDED
""",
    "whole": """
from fiveaxis.base import compiled
from fiveaxis.part import part

@compiled
def whole(n):
    return part(n)
""",
}


def test_machine_code_is_made_anew_where_a_part_or_a_constant_in_another_file_changes(tmp_path):
    def run(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        env = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
        words = [sys.executable, "-c", IN_FILES]
        done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=env, check=True)
        return done.stdout.split()

    for name, text in FILES.items():
        (tmp_path / f"{name}.py").write_text(text)
    assert run("whole", FILES["whole"]) == ["11.0", "0"]
    assert run("whole", FILES["whole"]) == ["11.0", "1"]
    assert run("constant", "ADDED = 20.0") == ["21.0", "0"]
    assert run("part", FILES["part"].replace("+", "-")) == ["-19.0", "0"]


PRODUCT = """
import sys
import numba
import numpy as np
from fiveaxis.cam import TriangleTree
TriangleTree.build(np.eye(3)[None]).distances(np.zeros((1, 3)))
print("scipy.linalg" in sys.modules)
print(numba.njit(lambda a: a @ a)(2.0 * np.eye(2))[1, 1], "scipy.linalg" in sys.modules)
"""


def test_loops_load_no_linear_algebra_and_matrices_are_still_multiplied():
    done = subprocess.run([sys.executable, "-c", PRODUCT], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "4.0", "True"], done.stderr


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no /proc")
def test_without_a_folder_for_machine_code_it_is_compiled_anew_and_that_is_said_once(tmp_path):
    copy = tmp_path / "fiveaxis"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    # Nobody, root neither, makes a folder where a file has its name, or a home in /proc.
    for folder in [copy, *(path for path in copy.rglob("*") if path.is_dir())]:
        (folder / "__pycache__").touch()
    env = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    env |= {"HOME": "/proc/nowhere", "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=env, cwd=tmp_path
    )
    assert (done.returncode, done.stdout[:5]) == (0, "0.577"), done.stderr
    assert done.stderr.count("machine code can't be kept") == 1
    assert "NUMBA_CACHE_DIR" in done.stderr
