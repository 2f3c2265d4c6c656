"""One job on several machines: which is cheapest, which is quickest, and how surely that is known."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fiveaxis.batch.ledger import own_folder
from fiveaxis.batch.record import ORDER, Listener, Row, Status
from fiveaxis.batch.run import Batch, run_batch
from fiveaxis.errors import SettingError
from fiveaxis.machine.files import machine_names

REPORT = "report.json"
# Share by which the time of a program on a machine that states its accelerations is known
# (docs/pages/checks.md); without accelerations it isn't known how surely.
TIME_KNOWN = 0.006
ALL = "all"


@dataclass(frozen=True)
class Candidate:
    """A job on one machine.

    Parameters
    ----------
    row : of the batch; its message says why the machine can't
    figures : further ones by name, with units; None where the program was kept back, or the machine doesn't
        state what they depend on
    """

    row: Row
    figures: Mapping[str, float | str | None]

    @property
    def machine(self) -> str:
        """Its name, or its file without folder."""
        name = str(self.row.values["machine"])
        return Path(name).stem if name.endswith(".toml") else name

    @property
    def can(self) -> bool:
        """Whether its program was released."""
        return self.row.status is Status.FINE

    @property
    def energy(self) -> tuple[float, float] | None:
        """Least and most energy of the feed drives, J."""
        least, most = self.row.energy_least, self.row.energy_most
        return None if least is None or most is None or not self.can else (least, most)

    @property
    def time(self) -> tuple[float, float] | None:
        """Shortest and longest run time, s; open at the top where the machine states no accelerations."""
        if self.row.time is None or not self.can:
            return None
        if self.figures.get("time_basis") != "accelerations":
            return self.row.time, float("inf")
        return self.row.time * (1.0 - TIME_KNOWN), self.row.time * (1.0 + TIME_KNOWN)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        row, energy = self.row, self.energy
        given = {"machine": self.machine, "status": str(row.status), "reason": row.message}
        span = None if energy is None else list(energy)
        return given | {"energy_J": row.energy, "energy_range_J": span, "time_s": row.time, **self.figures}


@dataclass(frozen=True)
class MachineComparison:
    """A job on several machines.

    Parameters
    ----------
    job : its name
    candidates : those that can by energy, then the others
    batch : that ran them, with its pages
    """

    job: str
    candidates: tuple[Candidate, ...]
    batch: Batch

    @property
    def exit_code(self) -> int:
        """0 where a machine can, else that of the best row."""
        return min((c.row.status for c in self.candidates), key=ORDER.index).exit_code

    @property
    def claims(self) -> tuple[str, str]:
        """Which machine is cheapest and which is quickest, or what has to be measured to know.

        Base power isn't in it: few machines state theirs, and unknown is never zero.
        """
        measure = "measure the axis powers of these (fiveaxis calibrate)"
        state = "state max_acceleration of the axes of these"
        return (
            self._claim("cheapest for the feed drives", "J", lambda c: c.energy, measure),
            self._claim("quickest", "s", lambda c: c.time, state),
        )

    def _claim(
        self,
        what: str,
        unit: str,
        span: Callable[[Candidate], tuple[float, float] | None],
        remedy: str,
    ) -> str:
        found = [(c.machine, s) for c in self.candidates if (s := span(c)) is not None]
        found.sort(key=lambda pair: pair[1])
        if not found:
            return f"No machine can run it, so none is {what}."
        if len(found) == 1:
            return f"Only {found[0][0]} can run it."
        (name, (low, high)), others = found[0], found[1:]
        close = [other for other, (least, _) in others if least <= high]
        if not close:
            second, (least, _) = others[0]
            return (
                f"{name} is {what}: {low:.0f} to {high:.0f} {unit}, and the next one, {second}, takes at "
                f"least {least:.0f} {unit}."
            )
        return (
            f"Which is {what} isn't known: the range of {name}, from {low:.0f} {unit} on, overlaps those of "
            f"{', '.join(close)}; {remedy} to decide."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data for JSON."""
        cheapest, quickest = self.claims
        rows = [candidate.as_dict() for candidate in self.candidates]
        return {"job": self.job, "machines": rows, "cheapest": cheapest, "quickest": quickest}


def compare_machines(
    job: str | Path,
    machines: Sequence[str | Path],
    folder: str | Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    tell: Listener | None = None,
) -> MachineComparison:
    """Run a job on several machines, each with postures of its own, and compare their programs.

    Where the job states no place of the part, it is where each machine reaches the path; where it has ranges
    for the setup, that is searched on every machine. A machine that can't is a row with the reason. A winner
    is named only where its range doesn't overlap the next one's.

    Parameters
    ----------
    job : job file; its own machine counts only if it is among `machines`
    machines : names of the library, files, or ``all`` for the library
    folder : for a folder per machine and the pages of `run_batch`
    scheduler, workers, tell : as for `run_batch`

    Raises
    ------
    SettingError
        Fewer than two machines; as `run_batch`.
    """
    names = list(dict.fromkeys(_named(machines)))
    if len(names) < 2:
        raise SettingError(f"machines: {', '.join(names) or 'none'}; name at least two, or all")
    how: Any = {"scheduler": scheduler, "workers": workers, "tell": tell}
    batch = run_batch([job], folder, machines=names, **how)
    candidates = [Candidate(row, _figures(own_folder(batch.folder, row.name) / REPORT)) for row in batch.rows]
    candidates.sort(key=lambda c: (c.energy is None, c.energy or (0.0, 0.0), c.machine))
    return MachineComparison(Path(job).stem, tuple(candidates), batch)


def _named(machines: Sequence[str | Path]) -> Iterator[str]:
    """Yield names of the library, and absolute paths of files: a job's are relative to its own folder."""
    for machine in map(str, machines):
        if machine == ALL:
            yield from machine_names()
        else:
            file = Path(machine)
            yield str(file.absolute()) if file.suffix == ".toml" and file.is_file() else machine


def _figures(file: Path) -> dict[str, float | str | None]:
    """Read what a machine's report says; nothing where its job ended before there was one."""
    if not file.is_file():
        return {}
    report = json.loads(file.read_text(encoding="utf-8"))
    energy, budget = report["energy"], report["budget"] or {}
    turns = [rate["speed_deg_s"] for rate in report["rates"].get("optimised", {}).values()]
    travel = {f"travel_{letter}_J": joules for letter, joules in energy["travel_by_axis"].items()}
    return {
        "with_base_J": energy["with_base"],
        "time_basis": report["program"]["run_time"]["basis"],
        "largest_rotary_deg_s": max(turns, default=None),
        "cost": budget.get("cost"),
        "co2_kg": budget.get("co2_kg"),
        **travel,
    }
