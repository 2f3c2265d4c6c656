"""Numbers, shares and cutters in words, the same on the page, on the terminal and in the answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fiveaxis.model import SHAPES, SpeedChange, Tool

MINUS, THIN_SPACE = "\u2212", "\u2009"
UNKNOWN, NO_CHANGE = "unknown", "no change"

NAMES = {
    "ball": "ball end mill",
    "flat": "square end mill",
    "bull": "bull-nose end mill",
    "lollipop": "lollipop cutter",
    "taper": "tapered ball end mill",
    "barrel": "barrel cutter",
    "drill": "drill",
}
DEGREES = ("half_angle", "point_angle")


def number(value: float | None, digits: int = 0, *, signed: bool = False) -> str:
    """Format a number with thin spaces between thousands and a true minus sign."""
    if value is None:
        return UNKNOWN
    # Adding 0 after rounding turns −0 into 0.
    rounded = round(value, digits) + 0.0
    text = f"{rounded:{'+' if signed and rounded else ''},.{digits}f}"
    return text.replace(",", THIN_SPACE).replace("-", MINUS)


def plain(value: float) -> str:
    """Format a number as short as possible, with a true minus sign."""
    return f"{value + 0.0:g}".replace("-", MINUS)


def plain_list(values: Sequence[float]) -> str:
    """Format numbers as short as possible, separated by commas."""
    return ", ".join(map(plain, values))


def saving(share: float | None) -> str:
    """Format a saved share: ``20.5 % less``, ``3.1 % more``."""
    if share is None:
        return UNKNOWN
    percent = round(100.0 * share, 1)
    if percent == 0.0:
        return NO_CHANGE
    return f"{abs(percent):.1f}{THIN_SPACE}% {'less' if percent > 0.0 else 'more'}"


def time_shares(limited: Mapping[str, float]) -> str:
    """Format for which shares of the time each cause limits the speed: ``feed 61 %, stops 20 %``."""
    total = sum(limited.values())
    shares = {cause: round(100.0 * time / total) for cause, time in limited.items()} if total else {}
    said = [f"{cause} {percent}{THIN_SPACE}%" for cause, percent in shares.items() if percent]
    rest = len(shares) - len(said)
    few = f"{rest} other{'s' if rest > 1 else ''} less than 0.5{THIN_SPACE}%"
    return ", ".join([*said, few] if rest else said)


def speed_change(letter: str, change: SpeedChange, line: int | None) -> str:
    """Format a change of an axis's speed with its place: the program's line, or the number of its block."""
    place = f"block {number(change.block)}" if line is None else f"line {number(line)}"
    size, unit = change.shown(letter)
    return f"{plain(float(f'{size:.3g}'))} {unit} ({place})"


def describe_cutter(tool: Tool) -> str:
    """Describe a cutter with its figures: ``bull-nose end mill, diameter 16 mm, corner radius 4 mm``."""
    cutter = tool.cutter
    if cutter.shape not in SHAPES:
        return str(tool)
    names = SHAPES[cutter.shape][1]
    figures = (
        f"{name.replace('_', ' ')} {figure:g}{'°' if name in DEGREES else ' mm'}"
        for name, figure in zip(names, cutter.figures, strict=True)
    )
    return ", ".join([NAMES.get(cutter.shape, cutter.shape), *figures])


def describe_tool(tool: Tool) -> str:
    """Describe a tool's cutter, and its shank and holder if they are known."""
    parts = [describe_cutter(tool)]
    if tool.shank_diameter is not None:
        parts.append(f"shank {tool.shank_diameter:g} mm")
    if tool.holder is not None:
        sections = " and ".join(
            f"{s.length:g} mm of {s.diameter:g} mm"
            + ("" if s.upper_diameter in (None, s.diameter) else f" to {s.upper_diameter:g} mm")
            for s in tool.holder.sections
        )
        parts.append(f"stick-out {tool.holder.stick_out:g} mm, holder {sections}")
    return "; ".join(parts)


def what_stays(tool: Tool) -> str:
    """Describe what is held while the tool leans."""
    if tool.cutter.is_ball:
        return "The ball’s centre is held, so the contact stays"
    return "The tool leans about its contact, which stays"
