"""Shop programs of five operations for five controls: facing, drilling, 3+2, and two in five axes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

# X, Y, Z of the tip, B and C in degrees.
Row = tuple[float, float, float, float, float]


def wall(radius: float, count: int = 30) -> list[Row]:
    """A quarter round a cylinder, the tool leaning to and fro."""
    turn = np.linspace(0.0, np.pi / 2.0, count)
    columns = (
        radius * np.cos(turn),
        radius * np.sin(turn),
        2.0 + turn,
        30.0 + 8.0 * np.sin(3.0 * turn),
        np.degrees(turn),
    )
    return [tuple(float(c) for c in row) for row in zip(*columns, strict=True)]


TILTED: list[Row] = [(20.0, -10.0, 5.0, 20.0, 30.0), (-20.0, -10.0, 5.0, 20.0, 30.0)]


@dataclass(frozen=True)
class Shop:
    """A control's words.

    Parameters
    ----------
    suffix : of its files
    begin, end : lines of the program
    face, drill : lines of the operations that have three axes
    tool : lines of a tool change with spindle and coolant
    start : lines before the cuts of an operation with TCP, from its first row
    word : writes a word; `block` a feed move of words with F or none, `rapid` a rapid one
    stop : lines that leave TCP
    """

    suffix: str
    begin: Sequence[str]
    end: Sequence[str]
    face: Sequence[str]
    drill: Sequence[str]
    tool: Callable[[int], list[str]]
    start: Callable[[int, str], list[str]]
    stop: Sequence[str]
    plus: str = ""
    equals: bool = False
    block: str = "{words}{feed}"
    first: str = "G1 {words}{feed}"
    rapid: str = "G0 {words}"
    numbered: bool = False

    def words(self, row: Row, letters: str = "XYZBC") -> str:
        """Write the words of a row."""
        values = dict(zip("XYZBC", row, strict=True))
        gap = "=" if self.equals else ""
        return " ".join(f"{c}{gap if c in 'BC' else ''}{values[c]:{self.plus}.3f}" for c in letters)

    def cuts(self, number: int, rows: Sequence[Row], feed: float) -> Iterator[str]:
        """Write an operation in five axes."""
        yield from self.tool(number)
        yield from self.start(number, self.words(rows[0], "BC"))
        above = (rows[0][0], rows[0][1], 60.0, *rows[0][3:])
        yield self.rapid.format(words=self.words(above, "XY"))
        yield self.rapid.format(words=self.words(above, "Z"))
        yield self.first.format(words=self.words(rows[0], "XYZ"), feed=f" F{feed:.0f}")
        for row in rows[1:]:
            yield self.block.format(words=self.words(row), feed="")
        yield self.rapid.format(words=self.words((0.0, 0.0, 60.0, 0.0, 0.0), "Z"))
        yield from self.stop

    def lines(self, count: int = 30, notes: Sequence[str] = ()) -> list[str]:
        """Write the program, with so many locations in each pass of five axes, and notes on its tools."""
        found = [
            *self.begin,
            *notes,
            *self.face,
            *self.drill,
            *self.cuts(3, wall(30.0, count), 1500.0),
            *self.cuts(4, TILTED, 800.0),
            *self.cuts(5, wall(24.0, count), 1200.0),
            *self.end,
        ]
        return [f"{number} {line}" for number, line in enumerate(found)] if self.numbered else found


def _iso_tool(number: int) -> list[str]:
    return [f"T{number} M6", f"S{2000 + 1000 * number} M3", "M8"]


ISO_FACE = (
    "T1 M6",
    "S2000 M3",
    "G0 X-40. Y0. B0. C0.",
    "G43 H1 Z50.",
    "G1 Z0. F500.",
    "X40.",
    "G0 Z50.",
    "M9",
)
ISO_DRILL = (
    "T2 M6",
    "S3000 M3",
    "G0 X20. Y20.",
    "G43 H2 Z50.",
    "G98 G81 X20. Y20. Z-15. R3. F200.",
    "X-20.",
    "G80",
)

FANUC = Shop(
    ".nc",
    ("%", "O1000 (BRACKET, 5 OPERATIONS)", "G21 G90 G94 G17 G40 G49 G80 G69", "G54"),
    ("G0 B0. C0.", "M30", "%"),
    ISO_FACE,
    ISO_DRILL,
    _iso_tool,
    lambda number, rotary: [f"G0 {rotary}", f"G43.4 H{number}"],
    ("G49", "G0 Z100. (CLEAR)"),
)
HAAS = Shop(
    ".nc",
    FANUC.begin,
    FANUC.end,
    ISO_FACE,
    ISO_DRILL,
    _iso_tool,
    lambda number, rotary: [f"G0 {rotary}", f"G234 H{number}"],
    ("G49", "G0 Z100."),
)
LINUXCNC = Shop(
    ".ngc",
    ("(bracket)", "G21 G90 G94 G17 G40 G49 G80 G54 G64 P0.01"),
    ("G0 B0. C0.", "M2"),
    ISO_FACE,
    ISO_DRILL,
    _iso_tool,
    lambda number, rotary: [f"G43 H{number}", f"G0 {rotary}", "M428"],
    ("M429", "G0 Z100."),
)
SINUMERIK = Shop(
    ".mpf",
    ("; BRACKET", "G40 G17 G710 G94 G90", "G54", "TRAFOOF"),
    ("G0 B=0 C=0", "M30"),
    ('T="MILL" M6', "S2000 M3", "G0 X-40 Y0 B=0 C=0 D1", "G0 Z50 M8", "G1 Z0 F500", "X40", "G0 Z50", "M9"),
    (
        'T="DRILL" M6',
        "S3000 M3",
        "G0 X20 Y20 D1",
        "G0 Z50",
        "F200",
        "MCALL CYCLE81(50,0,3,-15)",
        "X20 Y20",
        "X-20",
        "MCALL",
    ),
    lambda number: [f"T={number} M6", f"S{2000 + 1000 * number} M3", "M8"],
    lambda number, rotary: [f"G0 {rotary} D1", "TRAORI"],
    ("TRAFOOF", "G0 Z100 ; clear"),
    equals=True,
)
HEIDENHAIN = Shop(
    ".h",
    ("BEGIN PGM BRACKET MM", "; five operations", "L M129", "PLANE RESET STAY"),
    ("L B+0 C+0 R0 FMAX", "L M30", "END PGM BRACKET MM"),
    (
        "TOOL CALL 1 Z S2000",
        "L X-40 Y+0 B+0 C+0 R0 FMAX M3",
        "L Z+50 R0 FMAX M8",
        "L Z+0 R0 F500",
        "L X+40",
        "L Z+50 FMAX",
    ),
    (
        "TOOL CALL 2 Z S3000",
        "L X+20 Y+20 R0 FMAX M3",
        "L Z+50 R0 FMAX",
        "CYCL DEF 200 DRILLING Q200=+3 Q201=-15 Q206=+200 Q202=+5 Q210=+0 Q203=+0 Q204=+50 Q211=+0",
        "L X+20 Y+20 R0 FMAX M99",
        "L X-20 R0 FMAX M99",
    ),
    lambda number: [f"TOOL CALL {number} Z S{2000 + 1000 * number}", "L M3", "L M8"],
    lambda number, rotary: [f"L {rotary} R0 FMAX", "L M128"],
    ("L M129", "L Z+100 R0 FMAX"),
    plus="+",
    block="L {words} R0{feed}",
    first="L {words} R0{feed}",
    rapid="L {words} R0 FMAX",
    numbered=True,
)
SHOPS = {
    "fanuc": FANUC,
    "haas": HAAS,
    "linuxcnc": LINUXCNC,
    "sinumerik": SINUMERIK,
    "heidenhain": HEIDENHAIN,
}
