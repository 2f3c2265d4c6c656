"""All checks in one call."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Toolpath, for_tilt, tilt_bounds
from fiveaxis.verification.checks import check_contact, check_finite, check_limits, check_tilt
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.moves import check_deviation, check_jumps, check_speeds
from fiveaxis.verification.report import Report, make_report
from fiveaxis.verification.subject import DEFAULT_TOLERANCES, Tolerances, make_subject

if TYPE_CHECKING:
    import trimesh

# No check of this version looks at these; a report says so each time.
NOT_CHECKED = (
    "collision of shank and holder with the part, and of machine bodies with each other: not offered yet",
    "tilt and axis limits between locations: checked at the locations",
    "acceleration and jerk, and whether the durations keep the programmed feed",
)


def verify(
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    *,
    tilt: tuple[float, float] | None = None,
    cone: float | None = None,
    lead: tuple[float, float] | None = None,
    lean: tuple[float, float] | None = None,
    plane: tuple[float, float, float] | None = None,
    part: str | Path | trimesh.Trimesh | None = None,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
) -> Report:
    """Check a motion against its machine and its path, with kinematics of its own.

    The tool's place follows from the axis values through pinocchio, not through the equations that made them.

    Parameters
    ----------
    motion : axis values and durations, one row per location
    machine : chain, limits, highest speeds
    toolpath : the path that the motion follows
    tilt : smallest and largest angle between tool axis and surface normal, degrees
    cone : largest angle between tool axis and programmed axis, degrees
    lead, lean : smallest and largest angle by which the tool is tipped into the feed and to its left, degrees
    plane : a vector at right angles to a plane that the tool axis stays in, beside the others; with none of
        them, tilt isn't checked
    part : mesh of the finished part in mm, or its file; without it, gouges aren't checked
    tolerances : from where on a difference is a finding

    Returns
    -------
    Findings with the codes ``not-finite``, ``axis-limit``, ``contact-error``, ``tilt``, ``jump``, ``speed``,
    ``gouge`` (errors) and ``tip-deviation`` (warning), and the worst figure of every check.

    Raises
    ------
    SettingError
        Both tilt and cone; a bad range; a motion of other axes than the machine's.
    ToolpathError
        A motion of another length than the path; a path without the direction that tilt or cone refers to.
    MeshError
        The part can't be read.
    MissingDependency
        pinocchio isn't installed.
    """
    bounds = None
    if any(asked is not None for asked in (tilt, cone, lead, lean, plane)):
        toolpath = for_tilt(toolpath, tilt, cone, lead=lead, lean=lean)
        bounds = tilt_bounds(toolpath, tilt, cone, lead=lead, lean=lean, plane=plane)
    subject = make_subject(motion, machine, toolpath, bounds, tolerances)
    results = (
        check_finite(subject),
        check_limits(subject),
        check_contact(subject),
        check_tilt(subject),
        check_jumps(subject),
        check_speeds(subject),
        check_deviation(subject),
        check_gouge(subject, part),
    )
    return make_report(results, toolpath, NOT_CHECKED)
