"""Compile the loops of a wheel ahead, for this Python and platform: a first run then compiles nothing.

Usage: python .ci/compile_ahead.py dist/fiveaxis-0.1.0-py3-none-any.whl out/wheels

The wheel is installed in a fresh environment, and the examples run there; the machine code that numba
keeps beside the modules goes into a second wheel, tagged like numba's own. It asks for the same version
of numba, the only one that takes this code. Then the second wheel is tried: a file of machine code that is
written is an error. Runs under a Python that has `wheel`.

With `--libraries` those of another environment are used, and with `--compiled` what a copy of the package has
compiled: machine code of other sources isn't taken.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
# What most runs need: a part and a path, then a program revised in place, then bodies, holder and fixtures.
RUNS = (
    "optimise examples/overhang/job.toml -o {out}/job",
    "optimise {out}/job/program.ngc -m hayashi-640123 --tool ball:8 --cone 20 -o {out}/revised",
    "optimise examples/overhang/complete.toml -o {out}/complete",
)
ABOUT_NUMBA = """
import sys
from importlib.metadata import distribution
found = distribution("numba")
print(found.version)
print(*[line.split(": ")[1] for line in found.read_text("WHEEL").splitlines() if line.startswith("Tag: ")])
"""


def call(*words: object, **how: object) -> str:
    """Run a command, and return what it prints."""
    return subprocess.run([*map(str, words)], check=True, stdout=subprocess.PIPE, text=True, **how).stdout


def seconds(program: Path, words: str, out: Path) -> float:
    """Run fiveaxis as installed beside `program`; return seconds of processor, its children's included."""
    settings = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    call(program, *(word.format(out=out) for word in words.split()), cwd=ROOT, env=settings)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def make_wheel(pure: Path, package: Path, python: Path, work: Path, folder: Path) -> Path:
    """Write a wheel with the machine code that lies in an installed package, and return its place."""
    version, tags = call(python, "-c", ABOUT_NUMBA).splitlines()
    call(sys.executable, "-m", "wheel", "unpack", pure, "-d", work / "unpacked")
    [unpacked] = (work / "unpacked").iterdir()
    copy_machine_code(package, unpacked / "fiveaxis")
    [about] = unpacked.glob("*.dist-info")
    wheel, metadata = (about / "WHEEL"), (about / "METADATA")
    lines = [line for line in wheel.read_text().splitlines() if line and not line.startswith(("Tag", "Root"))]
    lines += ["Root-Is-Purelib: false", *(f"Tag: {tag}" for tag in tags.split())]
    wheel.write_text("\n".join(lines) + "\n")
    [asked] = [line for line in metadata.read_text().splitlines() if line.startswith("Requires-Dist: numba")]
    metadata.write_text(metadata.read_text().replace(asked, f"Requires-Dist: numba=={version}"))
    folder.mkdir(parents=True, exist_ok=True)
    call(sys.executable, "-m", "wheel", "pack", unpacked, "-d", folder)
    [made] = folder.glob(f"{pure.name.split('-py3')[0]}-{tags.split()[0].split('-')[0]}-*.whl")
    return made


def copy_machine_code(package: Path, other: Path) -> None:
    """Copy what numba keeps beside a package's modules beside those of the same package elsewhere."""
    for file in machine_code(package):
        place = other / file.relative_to(package)
        place.parent.mkdir(exist_ok=True)
        place.write_bytes(file.read_bytes())


def machine_code(package: Path) -> dict[Path, int]:
    """List the files that numba keeps beside the modules, with their times, ns."""
    return {file: file.stat().st_mtime_ns for file in package.rglob("*.nb[ic]")}


def main() -> int:
    """Make the wheel and try it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--libraries", type=Path, help="site-packages of an environment of the same Python")
    parser.add_argument("--compiled", type=Path, help="package with machine code")
    given = parser.parse_args()
    with TemporaryDirectory() as temporary:
        work = Path(temporary)
        call(sys.executable, "-m", "venv", work / "venv")
        python, program = (work / "venv" / "bin" / name for name in ("python", "fiveaxis"))
        [site] = (work / "venv").glob("lib/python*/site-packages")
        alone = ["--no-deps"] if given.libraries else []
        call(python, "-m", "pip", "install", "-q", *alone, given.wheel.resolve())
        package = site / "fiveaxis"
        if given.libraries:
            also = f"import site; site.addsitedir({str(given.libraries.resolve())!r})"
            (site / "libraries.pth").write_text(also)
        if given.compiled:
            copy_machine_code(given.compiled, package)
        first = [seconds(program, run, work) for run in RUNS]
        made = make_wheel(given.wheel, package, python, work, given.folder)
        # What the first wheel's runs compiled isn't pip's to remove.
        shutil.rmtree(package)
        call(python, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", made)
        kept = machine_code(package)
        ahead = [seconds(program, run, work) for run in RUNS]
        written = [file.name for file, time in machine_code(package).items() if kept.get(file) != time]
    sizes = [wheel.stat().st_size / 1e6 for wheel in (made, given.wheel)]
    print(f"{made}: {sizes[0]:.1f} MB, {sizes[1]:.1f} MB without machine code")
    print(f"runs of {sum(first):.1f} s of processor, with what is compiled in them; ahead {sum(ahead):.1f}")
    print(f"{len(written)} files written beside {len(kept)} that were compiled ahead", *written)
    return 1 if written or not kept else 0


if __name__ == "__main__":
    sys.exit(main())
