"""Nothing that decides between postures has digits that depend on the processor.

OpenBLAS chooses its kernels by processor, and so does numpy for functions that have vector code of their own;
`fiveaxis.base.geometry.vectors` has what takes their place.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "fiveaxis"
# Of numpy: what calls BLAS, and what has kernels by processor.
BLAS = {"convolve", "corrcoef", "correlate", "cov", "dot", "inner", "matmul", "matvec", "polyfit", "roots"}
BLAS |= {"tensordot", "vdot", "vecdot", "vecmat"}
VECTOR_CODE = {"arccos", "arccosh", "arcsin", "arcsinh", "arctan", "arctan2", "arctanh", "cbrt", "cosh"}
VECTOR_CODE |= {"exp", "exp2", "expm1", "float_power", "geomspace", "log", "log10", "log1p", "log2"}
VECTOR_CODE |= {"logaddexp", "logspace", "power", "sinh", "tan", "tanh"}
# Options that free numba or numpy to add up in another order.
OPTIONS = {"fastmath", "optimize", "parallel"}
# Who may use them, and why.
EXCEPTIONS = {
    "base/compiling.py": "keeps numba from looking for BLAS while it loads",
    "lab/calibration/drive_fits.py": "fits powers to logs before postures are chosen; users round them",
    "model/energy/totals.py": "draws powers for the range of savings, after the postures are chosen",
    "posture/local/ipopt.py": "states the problem in CasADi; IPOPT's own linear algebra is BLAS",
    "check/verification/tcp_moves.py": "judges a program that is chosen already",
    "show/viewer/": "draws",
}


def place(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def is_exception(path: Path) -> bool:
    return place(path).startswith(tuple(EXCEPTIONS))


def is_numpy(node: ast.AST, module: str = "np") -> bool:
    return isinstance(node, ast.Attribute | ast.Name) and ast.unparse(node) == module


def processor_code(text: str) -> Iterator[str]:
    """What in a module's code has digits that depend on the processor, with its line."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            yield f"{node.lineno}: @"
        elif isinstance(node, ast.Attribute):
            whole = ast.unparse(node)
            of_numpy = is_numpy(node.value) and node.attr in BLAS | VECTOR_CODE
            of_linalg = is_numpy(node.value, "np.linalg") and node.attr != "norm"
            if of_numpy or of_linalg or (node.attr == "dot" and whole != "ca.dot"):
                yield f"{node.lineno}: {whole}"
        elif isinstance(node, ast.Call):
            names = {str(keyword.arg) for keyword in node.keywords}
            if is_numpy(node.func, "np.linalg.norm") and "axis" not in names:
                yield f"{node.lineno}: np.linalg.norm without an axis"
            yield from (f"{node.lineno}: {name}=" for name in sorted(names & OPTIONS))
        elif isinstance(node, ast.ImportFrom | ast.Import):
            imported = [getattr(node, "module", None) or "", *(alias.name for alias in node.names)]
            if any("linalg" in name or name.startswith("scipy.interpolate") for name in imported):
                yield f"{node.lineno}: {ast.unparse(node)}"


MODULES = sorted(PACKAGE.rglob("*.py"))


def test_no_module_that_decides_uses_what_depends_on_the_processor():
    found = [
        f"{place(p)}:{use}" for p in MODULES if not is_exception(p) for use in processor_code(p.read_text())
    ]
    assert not found, "use fiveaxis.base.product, arctan2, arccos, arcsin, or the functions of math"


@pytest.mark.parametrize("exception", EXCEPTIONS)
def test_every_exception_is_one(exception):
    paths = [p for p in MODULES if place(p).startswith(exception)]
    assert any(use for p in paths for use in processor_code(p.read_text()))


@pytest.mark.parametrize(
    "line",
    [
        "a @ b",
        "a @= b",
        "np.dot(a, b)",
        "a.dot(b)",
        "np.linalg.inv(a)",
        "np.linalg.norm(a)",
        "np.arctan2(a, b)",
        "np.einsum('ij,jk', a, b, optimize=True)",
        "numba.njit(f, fastmath=True)",
        "from scipy.linalg import solve",
        "from numpy.linalg import inv",
    ],
)
def test_a_line_that_depends_on_the_processor_is_found(line):
    assert list(processor_code(line))


@pytest.mark.parametrize(
    "line", ["np.linalg.norm(a, axis=1)", "ca.dot(a, b)", "np.einsum('i,i', a, b)", "math.exp(a)"]
)
def test_a_line_that_does_not_is_not(line):
    assert not list(processor_code(line))
