"""The JSON document: every figure of a run as plain data; the same inputs give the same bytes."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from fiveaxis.energy import Energy
from fiveaxis.errors import InputError
from fiveaxis.files import hash_input, require_file, write_atomically
from fiveaxis.findings import Finding, count_codes, group_findings
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion, peak_rates
from fiveaxis.posture import Solution
from fiveaxis.report.cutters import describe_tool
from fiveaxis.toolpath import TiltBounds, Toolpath

# Attributes of `Energy` by which two programs are compared.
MEASURES = ("total", "travel", "with_base", "time")

UNITS = {
    "energy": "J",
    "time": "s",
    "savings_range": "shares, least and most on machines drawn from the bands of estimated powers",
    "savings": "share of the baseline, 1 is everything; negative is a loss",
    "speed_changes": "mm/s or deg/s; `block` counts the program's moves from its first location, and `line` "
    "is that of its text",
    "tilt": "deg",
    "residuals.tilt": "rad",
    "residuals.limit": "mm for linear axes, rad for rotary axes",
    "residuals.contact": "mm",
    "inputs.size": "byte",
}


def report_document(
    solution: Solution,
    verdict: Mapping[str, Any],
    *,
    inputs: Sequence[Mapping[str, Any]],
    program: Mapping[str, Any] | None = None,
    budget: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Collect all results of a run in one document of plain data.

    It has no clock time, no run time and no folder of the computer: the same inputs give the same document.

    Parameters
    ----------
    solution : the result with its baselines
    verdict : result of the verification of the program's text, as plain data: ``ok``, ``findings``,
        ``counts`` (by code; may count more than are listed), ``figures``, ``checked`` and ``not_checked``
        (sentences)
    inputs : the files that the run read, each from `describe_input`, with ``used_as`` where that is known
    program : the NC program, if there is one: ``blocks``, ``blocks_before``, ``inserted``, ``removed`` and
        ``redundant_kept_for`` (codes), the tolerances ``path_tolerance_mm`` and ``axis_tolerance_deg``
    budget : the electricity of the whole job by consumer, if it was computed

    Returns
    -------
    Keys in fixed order; energies in J, times in s, angles of ``tilt`` in degrees, the rest as in ``units``. A
    figure that isn't a finite number is None.
    """
    from_path = [f.as_dict() for f in solution.toolpath.findings]
    own = [f for f in from_path if f not in verdict["findings"]]
    findings = [_portable_finding(f) for f in (*own, *verdict["findings"])]
    verification = {k: verdict[k] for k in ("ok", "counts", "figures", "checked", "not_checked")}
    document = {
        "toolpath": _without_folder(solution.toolpath.name),
        "locations": solution.toolpath.count_given,
        "path_shape": solution.toolpath.shape,
        "curved_moves": _curved_moves(solution.toolpath),
        "energy": solution.energy.as_dict(),
        "baselines": {name: energy.as_dict() for name, energy in solution.baselines.items()},
        "missing_baselines": dict(solution.missing),
        "moved_baselines": {name: b.note for name, b in solution.compared.items() if b.note},
        "rates": {
            "optimised": _rates(solution, solution.motion),
            **{name: _rates(solution, b.motion) for name, b in solution.compared.items()},
        },
        "savings": {name: _savings(solution.energy, e) for name, e in solution.baselines.items()},
        "savings_range": {name: list(ends) for name, ends in solution.savings_ranges().items()},
        "bound": solution.bound
        and {**solution.bound.as_dict(), "gap": solution.gap, "in_words": solution.left},
        "summary": _summary(findings, solution.toolpath, verification["counts"]),
        "findings": findings,
        "verification": verification,
        "program": program and dict(program),
        "budget": budget and dict(budget),
        "solver": [stage.as_dict() for stage in solution.stages],
        "kkt": solution.kkt and solution.kkt.as_dict(),
        "machine": _machine(solution.machine),
        "tool": str(solution.toolpath.tool),
        "tool_in_words": describe_tool(solution.toolpath.tool),
        "tilt": _tilt(solution.tilt),
        "residuals": solution.residuals(),
        "inputs": [dict(entry) for entry in inputs],
        "units": dict(UNITS),
    }
    return {key: _plain(value) for key, value in document.items()}


def _curved_moves(toolpath: Toolpath) -> int:
    """Count the moves between given locations that follow a curve."""
    return len(np.unique(toolpath.numbered[toolpath.curved]))


def _rates(solution: Solution, motion: Motion) -> dict[str, Any]:
    return {c: rate.as_dict() for c, rate in peak_rates(solution.machine, motion).items()}


def _summary(
    findings: Sequence[Mapping[str, Any]], toolpath: Toolpath, counts: Mapping[str, int]
) -> list[dict[str, Any]]:
    """Group findings by cause; those that optimiser and verification both report count once."""
    total = Counter(count_codes(toolpath.findings)) | Counter(counts)
    return [cause.as_dict() for cause in group_findings(map(Finding.from_dict, findings), total)]


def describe_input(path: str | Path) -> dict[str, Any]:
    """Describe an input file so that it can be recognised: ``name``, ``sha256``, ``size`` in bytes.

    Raises
    ------
    InputError
        The file can't be read.
    """
    digest = hash_input(path, InputError)
    return {"name": Path(path).name, "sha256": digest, "size": require_file(path, InputError).st_size}


def write_json(document: Mapping[str, Any], path: str | Path) -> Path:
    """Write a document as JSON: keys in their order, indented, with a newline at the end.

    Raises
    ------
    SettingError
        The file can't be written there.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return write_atomically(path, text + "\n")


def _savings(energy: Energy, baseline: Energy) -> dict[str, float | None]:
    """Compute the saved share by each measure."""
    return {name: _share(getattr(energy, name), getattr(baseline, name)) for name in MEASURES}


def _share(after: float | None, before: float | None) -> float | None:
    """Compute the saved share; None if a measure is unknown or there was nothing to save."""
    if after is None or before is None or not before > 0.0:
        return None
    return 1.0 - after / before


def _machine(machine: Machine) -> dict[str, Any]:
    return {
        "name": machine.name,
        "code": str(machine.code),
        "description": machine.description,
        "axes": machine.letters,
        "base_power": machine.base_power,
        "setup": {"offset": list(machine.setup.offset), "rotation_deg": list(machine.setup.rotation_deg)},
        "tool_length": machine.tool_length,
        "acceleration_unknown": [a.letter for a in machine.axes if a.max_acceleration is None],
        "figures": [p.as_dict() for p in machine.provenance],
    }


def _tilt(tilt: TiltBounds) -> dict[str, Any]:
    # A bound given as 15 deg comes back as 15, not as 14.999999999999998.
    low, high = (round(math.degrees(bound), 9) for bound in (tilt.low, tilt.high))
    return {"low": low, "high": high, "reference": tilt.name}


def _portable_finding(finding: Mapping[str, Any]) -> dict[str, Any]:
    """Copy a finding without the folder of its file."""
    copy = dict(finding)
    place = copy.get("place")
    if isinstance(place, Mapping) and place.get("file") is not None:
        copy["place"] = {**place, "file": _without_folder(place["file"])}
    return copy


def _without_folder(name: str) -> str:
    """Keep the last part of an absolute path; anything else stays as it is."""
    path = PurePath(name)
    return path.name if path.is_absolute() else name


def _plain(value: Any) -> Any:
    """Convert to types that JSON has: numpy numbers to Python's, numbers that aren't finite to None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, str):
        return str(value)
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [_plain(item) for item in value] if isinstance(value, Iterable) else value
