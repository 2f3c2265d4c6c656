"""Compare fiveaxis with what a user would take instead: tables and a picture from one run.

Usage: python tests/benchmarks/peers [CASES] [--methods "IPOPT; lattice"] [--again] [--limit 600]
           [--results FOLDER]   one JSON file for each case and method; what is there isn't run again
           [--page]             write docs/pages/research/peers.md's tables and picture

Every method runs alone in a process of its own. Its postures become a program with the same inserted blocks,
priced by the same drives, and an independent checker counts what they break. A new method is a function in
``methods.py``, a new case a file in ``cases/``.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

from case import case_names
from methods import BOUND, METHODS

HERE = Path(__file__).parent
DOCS = HERE.parents[2] / "docs" / "pages"
PAGE, PICTURE = DOCS / "research" / "peers.md", DOCS / "pictures" / "peers.svg"
TABLE = re.compile(r"(?<=<!-- table -->\n).*(?=<!-- end -->)", re.DOTALL)
# Figures of a result that have a table, each with its key.
FIGURES = (("energy", "Energy, J"), ("travel", "Travel metric, J"))

Result = dict[str, Any]


def file_of(folder: Path, case: str, method: str) -> Path:
    return folder / f"{case}, {method}.json"


def result_of(folder: Path, case: str, method: str, limit: float, again: bool) -> Result:
    """Run a method, or read its result of a run before."""
    file = file_of(folder, case, method)
    if file.exists() and not again:
        return json.loads(file.read_text(encoding="utf-8"))
    command = [sys.executable, str(HERE / "running.py"), case, method]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
        lines = (run.stdout or run.stderr).strip().splitlines()
        result = json.loads(lines[-1]) if run.returncode == 0 else {"why": lines[-1]}
    except subprocess.TimeoutExpired:
        result = {"why": f"not done in {limit:.0f} s"}
    result = {"case": case, "method": method} | result
    file.write_text(json.dumps(result, indent=1), encoding="utf-8")
    return result


def cell_of(result: Result | None, key: str) -> str:
    """Write a figure of a result, with a star where the result breaks a bound."""
    if result is None or result.get(key) is None:
        return ""
    number = f"{result[key]:,.0f}".replace(",", " ")
    return f"{number}*" if result.get("violations") else number


def broken_by(result: Result) -> str:
    """Say what a result breaks, and at how many locations, or why there is none; else nothing."""
    if "why" in result:
        return f"{result['method']}: {result['why']}"
    broken = [f"{what} at {count}" for what, count in result["violations"].items()]
    return f"{result['method']} breaks {', '.join(broken)}" if broken else ""


def line_of(result: Result) -> str:
    """Say in a line what a method made of a case."""
    if "why" in result:
        return broken_by(result)
    figures = [f"{title} {cell_of(result, key)}" for key, title in FIGURES]
    spent = f"{result['processor']:.1f} s of processor, {result['memory']:.0f} MB"
    told = f"{result['method']}: {', '.join(figures)}, {spent}"
    return "; ".join(filter(None, (told, broken_by(result))))


def left_of(bound: float, results: list[Result]) -> str:
    """Say how far the lowest travel metric that breaks nothing is above the bound."""
    kept = [r["travel"] for r in results if r["method"] != BOUND and r.get("violations") == {}]
    if not kept:
        return ""
    return f"at most {100.0 * (1.0 - bound / min(kept)):.1f} % of the lowest travel metric left"


def table_of(results: list[Result]) -> str:
    """Write all results: a table for each figure, with a row for each method and a column for each case."""
    cases = list(dict.fromkeys(result["case"] for result in results))
    methods = list(dict.fromkeys(result["method"] for result in results))
    found = {(result["case"], result["method"]): result for result in results}
    lines = []
    for key, title in FIGURES:
        lines += ["", f"| {title} | {' | '.join(cases)} |", f"|---|{'---:|' * len(cases)}"]
        for method in methods:
            cells = [cell_of(found.get((case, method)), key) for case in cases]
            if any(cells):
                lines.append(f"| {method} | {' | '.join(cells)} |")
    lines.append("")
    for case in cases:
        own = [result for result in results if result["case"] == case]
        said = [text for text in map(broken_by, own) if text]
        bounds = [r["travel"] for r in own if r["method"] == BOUND and "travel" in r]
        said += [text for bound in bounds if (text := left_of(bound, own))]
        count = next((result["locations"] for result in own if "locations" in result), 0)
        lines.append(f"- **{case}**, {count} locations{''.join(f'; {text}' for text in said)}.")
    return "\n".join(lines) + "\n\n"


def made_on() -> str:
    """Say on which computer, with which versions."""
    info = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*: (.*)", info.read_text(encoding="utf-8")) if info.exists() else []
    packages = ", ".join(f"{name} {version(name)}" for name in ("fiveaxis", "numpy", "scipy", "casadi"))
    cores = f"{os.cpu_count()} cores of {names[0] if names else platform.machine()}"
    return f"{cores}, {platform.system()}, Python {platform.python_version()}, {packages}."


def draw(results: list[Result], file: Path) -> None:
    """Draw energy against processor time: a panel for each case, a mark for each method."""
    from matplotlib.figure import Figure

    cases = list(dict.fromkeys(result["case"] for result in results))
    across = 3
    down = -(-len(cases) // across)
    figure = Figure(figsize=(3.6 * across, 2.9 * down + 0.8), layout="constrained")
    panels = figure.subplots(down, across, squeeze=False).ravel()
    marks = dict(zip(METHODS, "osDv^Xp*hP<>", strict=False))
    for panel, case in zip(panels, cases, strict=False):
        for number, (method, mark) in enumerate(marks.items()):
            own = [r for r in results if (r["case"], r["method"]) == (case, method) and r.get("energy")]
            for result in own:
                allowed = not result["violations"]
                face = f"C{number}" if allowed else "none"
                panel.plot(
                    result["processor"], result["energy"], mark, color=f"C{number}", markerfacecolor=face
                )
        panel.set(xscale="log", yscale="log", title=case)
        panel.grid(alpha=0.3, which="both")
    for panel in panels[len(cases) :]:
        panel.set_axis_off()
    for number, (method, mark) in enumerate(marks.items()):
        panels[0].plot([], [], mark, color=f"C{number}", label=method)
    figure.supxlabel("processor time, s")
    figure.supylabel("energy of the feed drives, J")
    figure.legend(loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(file, metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", help=", ".join(case_names()))
    parser.add_argument("--methods", help="; ".join(METHODS))
    parser.add_argument("--results", type=Path, default=Path(tempfile.gettempdir()) / "fiveaxis-peers")
    parser.add_argument("--limit", type=float, default=600.0)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--page", action="store_true")
    given = parser.parse_args()
    methods = [name.strip() for name in given.methods.split(";")] if given.methods else [*METHODS, BOUND]
    if unknown := set(methods) - {*METHODS, BOUND} | set(given.cases) - set(case_names()):
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    given.results.mkdir(parents=True, exist_ok=True)
    results = []
    for case in given.cases or case_names():
        for method in methods:
            results.append(result_of(given.results, case, method, given.limit, given.again))
            print(f"{case}: {line_of(results[-1])}", flush=True)
    text = f"{made_on()}\n{table_of(results)}"
    print(text)
    if given.page:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(TABLE.sub(lambda _: text, page), encoding="utf-8")
        draw(results, PICTURE)
