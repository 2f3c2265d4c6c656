"""The check of changes of speed against the axes' highest accelerations."""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import Array
from fiveaxis.verification.check_context import CheckContext
from fiveaxis.verification.checks import largest
from fiveaxis.verification.report import Result

KINDS = {"rotary": True, "linear": False}


def check_accelerations(context: CheckContext, kind: str) -> Result:
    """Check the change of every axis's mean speed from one cutting block to the next.

    It is measured over the mean of both durations. Beyond the highest acceleration a control slows down or
    rounds the corner, so the feed isn't the programmed one: a warning.

    Parameters
    ----------
    kind : ``rotary`` or ``linear``: which axes
    """
    axes = context.machine.axes
    columns = [c for c, a in enumerate(axes) if a.is_rotary is KINDS[kind]]
    known = [c for c in columns if axes[c].max_acceleration is not None]
    unknown = ", ".join(axes[c].letter for c in columns if c not in known)
    most = np.array([axes[c].max_acceleration for c in known], dtype=float)
    change = speed_changes(context)[:, known]
    share = np.divide(change, most, out=np.zeros_like(change), where=most > 0.0)
    rows, which = np.nonzero(share > 1.0 + context.tolerances.acceleration)

    def message(i: int) -> str:
        axis = axes[known[which[i]]]
        asked, bound = axis.shown(change[rows[i], which[i]]), axis.shown(most[which[i]])
        return (
            f"{axis.letter} changes its speed by {asked:.4g} {axis.unit}/s² from one cutting block to the "
            f"next, and can do {bound:g} {axis.unit}/s²: the control slows down or rounds the corner; lower "
            "the feed or smooth the path"
        )

    letters = ", ".join(axes[c].letter for c in known)
    return Result(
        code=f"{kind}-acceleration",
        severity=Severity.WARNING,
        rows=rows,
        values=share[rows, which],
        message=message,
        figures={f"{kind}_acceleration_share": largest(share) if known else None},
        checked=(f"acceleration of {letters} from each cutting block to the next",) if known else (),
        not_checked=(f"acceleration of {unknown}: the machine states no highest one",) if unknown else (),
    )


def speed_changes(context: CheckContext) -> Array:
    """Measure the change of speed at each location between two cuts; (n, k) mm/s² and rad/s², 0 elsewhere."""
    time = context.motion.time
    timed = context.cutting & np.isfinite(time) & (time > 0.0)
    lasting = np.where(timed, time, 1.0)
    speed = np.diff(context.positions, axis=0, prepend=context.positions[:1]) / lasting[:, None]
    both = timed[1:] & timed[:-1]
    between = (lasting[1:] + lasting[:-1]) / 2.0
    change = np.zeros_like(speed)
    change[:-1][both] = np.abs(np.diff(speed, axis=0))[both] / between[both, None]
    # Next to a value that is no number (`check_finite`) nothing is known.
    return np.nan_to_num(change, nan=0.0, posinf=math.inf)
