"""A finishing pass for a trunnion with A and C whose tool axis wavers, so that other postures are cheaper."""

import math

Row = tuple[float, float, float, float, float]


def wavering(count: int = 40) -> list[Row]:
    """Return the tip, mm, and the words of A and C, deg, as LinuxCNC's ``xyzac-trt`` takes them with TCP."""
    rows = []
    for t in (i / (count - 1) for i in range(count)):
        tip = (-30.0 + 60.0 * t, 10.0 * math.sin(2.0 * math.pi * t), 5.0 + 3.0 * math.cos(4.0 * math.pi * t))
        a, c = -20.0 - 6.0 * math.sin(9.0 * math.pi * t), 90.0 * t + 10.0 * math.sin(13.0 * math.pi * t)
        rows.append((*tip, a, c))
    return rows
