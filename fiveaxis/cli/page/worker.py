"""One piece of work of the page in a process of its own: a request on stdin, lines of JSON on stdout.

Killing the process is the cancel. It ends by itself, and takes the session's files away, when the server's
end of the pipe closes, however the server ended.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

from fiveaxis.base import (
    FiveAxisError,
    Gap,
    Infeasible,
    Meter,
    ProgressReport,
    group_findings,
)
from fiveaxis.job import (
    Job,
    Outcome,
    RevisedProgram,
    make_job,
    read_job,
    revise_operations,
    revises,
    run_job,
    write_outcome,
    write_revised,
)
from fiveaxis.model import Energy, draft_machine, load_machine, machine_names
from fiveaxis.show import describe_machine, look, show_program, write_preview

Ask = Mapping[str, Any]
# s between two messages of one stage.
PAUSE = 0.25
# The machine of the session with what was answered, the simulation as it is, and the results.
MACHINE, AS_IT_IS, RESULT = "machine.toml", "as-it-is.html", "result"
# Axes of a machine whose tool leans.
FIVE = 5
# Ends what a machine's description says first, which its tile shows.
STOP = ";"


class Teller:
    """Sends messages: stages not too often, results whole."""

    def __init__(self, stream: TextIO, folder: str) -> None:
        self._stream = stream
        self._folders = [json.dumps(f"{folder}{os.sep}{part}{os.sep}")[1:-1] for part in ("given", "made")]
        self.meter = Meter(self._step, pause=PAUSE)

    def send(self, **message: Any) -> None:
        """Send a message, in which files of the session have their names alone."""
        text = json.dumps(message)
        for folder in self._folders:
            text = text.replace(folder, "")
        self._stream.write(text + "\n")
        self._stream.flush()

    def _step(self, report: ProgressReport) -> None:
        self.send(stage=report.stage, id=report.id, share=report.share, left=report.left)


def machines(_: Ask, _teller: Teller) -> list[dict[str, Any]]:
    """List the five-axis machines of the library."""
    found = []
    for name in machine_names():
        sheet = describe_machine(load_machine(name))
        if len(sheet["axes"]) == FIVE:
            about = sheet["description"].strip().partition(STOP)[0]
            found.append({"name": name, "kind": sheet["kind"], "axes": sheet["axes"], "about": about})
    return found


def seen(ask: Ask, teller: Teller) -> dict[str, Any]:
    """Look at a program as it is, and write its simulation."""
    path, folder, reading = Path(ask["program"]), Path(ask["folder"]), _given(ask, "rapid")
    own = _given(ask, "tool", "tool_length")
    told = look(path, _machine_of(ask), progress=teller.meter, **own, **reading)
    teller.send(seen=told.as_dict() | {"totals": _totals(each.energy for each in told.operations)})
    shown, why = None, ""
    try:
        around = _given(ask, "tool", "part")
        whole = show_program(path, told.machine, progress=teller.meter, **around, **reading)
        write_preview(whole, folder / AS_IT_IS)
        shown = AS_IT_IS
    except FiveAxisError as fault:
        why = str(fault)
    return {"simulation": shown, "no_simulation": why}


def improved(ask: Ask, teller: Teller) -> dict[str, Any]:
    """Give a program's operations better postures, or make a program for a part, path or job."""
    folder = Path(ask["folder"]) / RESULT
    shutil.rmtree(folder, ignore_errors=True)
    job = _job(ask)
    if not revises(job):
        return _planned(job, folder, teller)
    made = revise_operations(job, teller.meter)
    files = write_revised(made, folder, teller.meter) if made.outcomes else []
    before = _totals(part.before for part in made.parts)
    after = _totals(part.after for part in made.parts)
    pages = {str(number): f"operation-{number}/" for number in made.outcomes}
    return _result(made.verdict, before, after, "your program", files, made.outcomes.values(), pages) | {
        "parts": [
            {"number": part.operation.number, "verdict": part.verdict, "why": part.why} for part in made.parts
        ],
        "other": _other(made),
    }


def _planned(job: Job, folder: Path, teller: Teller) -> dict[str, Any]:
    outcome = run_job(job, teller.meter)
    files = write_outcome(outcome, folder, teller.meter)
    name = outcome.report.baseline or ""
    baseline = outcome.solution.compared.get(name)
    before = None if baseline is None else _totals([baseline.energy])
    after = _totals([outcome.solution.energy])
    return _result("new", before, after, f"the baseline {name}", files, [outcome], {"": ""})


def _result(
    verdict: str,
    before: Mapping[str, Any] | None,
    after: Mapping[str, Any],
    against: str,
    files: Sequence[Path],
    outcomes: Iterable[Outcome],
    pages: Mapping[str, str],
) -> dict[str, Any]:
    outcomes = list(outcomes)
    program = next((file.name for file in files if file.name.startswith("program.")), None)
    gaps = dict.fromkeys(gap for outcome in outcomes for gap in outcome.verdict.risks)
    causes = group_findings([finding for outcome in outcomes for finding in outcome.verdict.findings])
    return {
        "verdict": verdict,
        "before": before,
        "after": after,
        "against": against,
        "program": program,
        "verified": all(outcome.gate.is_open for outcome in outcomes),
        "risks": _risks(gaps),
        "found": [cause.as_dict() for cause in causes if cause.severity != "note"],
        "pages": [{"name": name, "folder": folder} for name, folder in pages.items()],
    }


def _risks(gaps: Iterable[Gap]) -> list[dict[str, Any]]:
    """Group what wasn't checked by what settles it."""
    found: dict[tuple[str, str], list[str]] = {}
    for gap in gaps:
        found.setdefault((gap.add, gap.to), []).append(gap.sentence.partition(":")[0])
    return [{"what": list(dict.fromkeys(w)), "add": add, "to": to} for (add, to), w in found.items()]


def _other(made: RevisedProgram) -> dict[str, Any] | None:
    """Return what is cheaper and worse in something, of operations that stay, and what allows it."""
    others = [part.better.facts["other"] for part in made.parts if part.better is not None]
    kept = [other for other in others if other is not None]
    trades = sorted({trade for other in kept for trade in other["trades"]})
    return {"trades": trades, "saved": max(other["saved"] for other in kept)} if kept else None


def _totals(energies: Iterable[Energy | None]) -> dict[str, Any]:
    known = [energy for energy in energies if energy is not None]
    return {
        "time": sum(energy.time for energy in known),
        "energy": sum(energy.total for energy in known),
        "turns": sum(energy.starts + energy.reversals for energy in known),
    }


def _job(ask: Ask) -> Job:
    path = Path(ask["program"])
    given = _given(ask, "tool", "tilt", "cone", "effort", "feed", "control", "tool_length", "part", "allow")
    if ask.get("machine"):
        machine = _machine_of(ask)
        powered = load_machine(machine).has_powers
        given |= {"machine": str(machine), "drives": None if powered else "estimated"}
    given["nc"] = _given(ask, "retract")
    if path.suffix.lower() == ".toml":
        return read_job(path, **given)
    program = _given(ask, "rapid") | {"operation": tuple(ask.get("operations") or ()) or None}
    return make_job(input=path, plan=_given(ask, "strategy", "stepdown"), program=program, **given)


def _given(ask: Ask, *names: str) -> dict[str, Any]:
    """Return what somebody chose; 0 is chosen, too."""
    chosen = {name: ask[name] for name in names if ask.get(name) is not None}
    return {name: tuple(value) if isinstance(value, list) else value for name, value in chosen.items()}


def _machine_of(ask: Ask) -> str | Path:
    answers = ask.get("answers") or {}
    if not answers:
        return str(ask["machine"])
    base = load_machine(ask["machine"])
    split = {name.rpartition("."): str(text) for name, text in answers.items()}
    made = draft_machine({(question, letter): text for (letter, _, question), text in split.items()}, base)
    path = Path(ask["folder"]) / MACHINE
    path.write_text(made.text, encoding="utf-8")
    return path


WORK: Mapping[str, Callable[[Ask, Teller], Any]] = {"machines": machines, "look": seen, "improve": improved}


def main() -> None:
    """Do the piece of work that a line on stdin asks for; the argument is the session's folder."""
    folder = sys.argv[1]
    stream = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(2, 1)
    teller = Teller(stream, folder)
    line = sys.stdin.readline()
    threading.Thread(target=_end_with_server, args=(folder,), daemon=True).start()
    if not line:
        _end_with_server(folder)
    ask = json.loads(line)
    try:
        teller.send(result=WORK[ask["verb"]](ask, teller))
    except FiveAxisError as fault:
        causes = group_findings(fault.findings) if isinstance(fault, Infeasible) else ()
        told = [cause.as_dict() for cause in causes]
        teller.send(error=str(fault), kind=type(fault).__name__, causes=told)
    except Exception as fault:
        traceback.print_exc()
        teller.send(error=f"a fault of fiveaxis itself: {fault!r}", kind="Fault", causes=[])


def _end_with_server(folder: str) -> None:
    with contextlib.suppress(OSError):
        sys.stdin.read()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


if __name__ == "__main__":
    main()
