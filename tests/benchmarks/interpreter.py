"""Programs run by LinuxCNC's interpreter and read by us: what differs, and what one of the two refuses.

    python tests/benchmarks/interpreter.py [--count N] [--first SEED] [--only examples|drawn]

Every example program that LinuxCNC's package installs, and N programs drawn from seeds
(``tests/support/interpretable_programs.py``: arcs in all planes, cycles, shifts, feed modes, units,
expressions, O words, rotary axes). Of a drawn program the line that one of the two refuses is
left out, and the rest compared.
Needs ``rs274`` (linuxcnc-uspace).

The exit code is 1 if a program is read differently.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.compared_moves import Comparison, compare, compare_lines
from support.interpretable_programs import program
from support.rs274 import RS274

from fiveaxis.model import Machine, load_machine

PACKAGE = "linuxcnc-uspace"
# Machines whose axes the examples name, by their word of the second rotary axis.
BY_A, BY_B = (
    replace(load_machine(name), control="linuxcnc") for name in ("hayashi-640123", "linuxcnc-xyzbc-trt")
)
_COMMENT = re.compile(r"\([^)]*\)|;.*")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def examples(folder: Path) -> Iterator[tuple[str, Comparison]]:
    """Compare on the installed programs, each in a copy of its folder's files."""
    listed = subprocess.run(["dpkg", "-L", PACKAGE], capture_output=True, text=True, check=True).stdout
    for file in sorted(Path(line) for line in listed.splitlines() if line.endswith(".ngc")):
        if not file.is_file():
            continue
        copy = folder / file.relative_to("/")
        for each in () if copy.exists() else file.parent.iterdir():
            if each.is_file():
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(each, copy.parent / each.name)
        yield str(file), compare(copy, _machine(file))


def _machine(file: Path) -> Machine:
    code = _COMMENT.sub("", file.read_text(encoding="utf-8", errors="replace")).upper()
    return BY_B if re.search(r"\bB *[-#\[0-9]", code) else BY_A


def drawn(folder: Path, seeds: range) -> Iterator[tuple[str, Comparison]]:
    """Compare on drawn programs, without the lines that are refused."""
    for seed in seeds:
        for found in compare_lines(program(seed), folder / "drawn.ngc", BY_A):
            yield f"seed {seed}", found


def report(title: str, found: Iterator[tuple[str, Comparison]]) -> int:
    """Print the counts of one kind of programs and, by reason, where they differ; return how many differ."""
    counts: Counter[str] = Counter()
    reasons: dict[tuple[str, str], list[tuple[str, str]]] = defaultdict(list)
    for name, comparison in found:
        counts[comparison.verdict] += 1
        if comparison.verdict in ("differs", "refused by us", "refused by it"):
            fact = comparison.fact.split(" || ")[-1 if comparison.verdict == "refused by us" else 0]
            fact = re.sub(r"^\S*\.ngc:", "line ", fact)
            reasons[comparison.verdict, _NUMBER.sub("#", fact)[:60]].append((name, fact))
    print(f"{title}: {', '.join(f'{count} {verdict}' for verdict, count in counts.most_common())}")
    for (verdict, _), places in sorted(reasons.items(), key=lambda item: (item[0][0], -len(item[1]))):
        name, fact = places[0]
        print(f"  {len(places):4d} {verdict}: {name}: {fact[:200]}")
    return counts["differs"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", choices=("examples", "drawn"))
    asked = parser.parse_args()
    if RS274 is None:
        print(f"rs274 isn't installed (apt-get install {PACKAGE})")
        return 2
    differ = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if asked.only != "drawn":
            differ += report("examples", examples(folder))
        if asked.only != "examples":
            differ += report("drawn", drawn(folder, range(asked.first, asked.first + asked.count)))
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main())
