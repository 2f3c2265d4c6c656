"""Programs for LinuxCNC's interpreter, drawn from a seed: short, so that one refusal hides little else."""

import math
import random
from collections.abc import Callable

PLANES = {
    "G17": ("X", "Y", "I", "J", "Z"),
    "G18": ("Z", "X", "K", "I", "Y"),
    "G19": ("Y", "Z", "J", "K", "X"),
}
# By how much the ends of arcs miss their circles, mm: below and above the bounds of the control.
MISSED = (0.0, 0.0, 0.0, 0.002, 0.01, 0.025, 0.05, 0.3)
OPERATORS = ("+", "-", "*", "/", "**", "MOD", "AND", "OR", "XOR", "EQ", "NE", "LT", "LE", "GT", "GE")
FUNCTIONS = ("SIN", "COS", "TAN", "SQRT", "ABS", "FIX", "FUP", "ROUND", "EXP", "ATAN", "ACOS", "LN")


class Writer:
    """Writes one program.

    Parameters
    ----------
    seed : what is drawn
    rotary : letters of the rotary axes that blocks may name
    """

    def __init__(self, seed: int, rotary: str = "AC") -> None:
        self.draw, self.rotary = random.Random(seed), rotary
        self.lines: list[str] = []
        self.names = 0

    def text(self) -> str:
        """Return the program: a first block that states the modes, up to twelve drawn ones, and M2."""
        draw = self.draw
        unit, mode = draw.choice(("G21", "G21", "G20")), draw.choice(("G90", "G90", "G91"))
        plane = draw.choice(("G17", "G17", "G18", "G19"))
        level = draw.choice(("G98", "G99"))
        self.lines += [
            f"{unit} {mode} {plane} {level} G40 G49 G80 G94",
            "#1=3",
            "S600 M3 F200",
            "G0 X1 Y2 Z3",
        ]
        self.some(draw.randint(3, 12))
        return "\n".join([*(self._numbered(i, t) for i, t in enumerate(self.lines, start=1)), "M2", ""])

    def some(self, count: int) -> None:
        """Write some blocks."""
        kinds: list[tuple[int, Callable[[], str]]] = [
            (6, self.straight),
            (6, self.arc),
            (3, self.cycle),
            (3, self.shift),
            (3, self.mode),
            (3, self.expression),
            (1, self.dwell),
        ]
        weights = [weight for weight, _ in kinds]
        for _ in range(count):
            [kind] = self.draw.choices([make for _, make in kinds], weights)
            self.lines.append(kind())
            if self.draw.random() < 0.12 and self.names < 3:
                self.branch()

    @staticmethod
    def _numbered(number: int, text: str) -> str:
        return text if text[:1] in "oO#" else f"N{number} {text}"

    def number(self, size: float = 20.0) -> str:
        """Return a number with up to three decimals."""
        return f"{self.draw.uniform(-size, size):.{self.draw.randint(0, 3)}f}"

    def words(self, letters: str, most: int) -> str:
        """Return words of some letters."""
        chosen = self.draw.sample(letters, self.draw.randint(1, min(most, len(letters))))
        return " ".join(f"{letter}{self.number()}" for letter in chosen)

    def straight(self) -> str:
        """Return a straight move."""
        word = self.draw.choice(("G0", "G1", "G1", "G1", "G53 G0", "G28", "G53 G1", ""))
        feed = f" F{self.draw.choice((0.001, 0.5, 30, 400))}" if self.draw.random() < 0.4 else ""
        return f"{word} {self.words('XYZ' + self.rotary, 3)}{feed}".strip()

    def arc(self) -> str:
        """Return an arc whose ends miss their circle by some of `MISSED`."""
        draw = self.draw
        plane = draw.choice(list(PLANES))
        x, y, i, j, z = PLANES[plane]
        word, radius, begin, turn = (
            draw.choice(("G2", "G3")),
            draw.uniform(0.5, 15),
            *(draw.uniform(0.0, 2.0 * math.pi) for _ in range(2)),
        )
        feed = f" F{draw.choice((0.5, 50, 300))}" if draw.random() < 0.5 else ""
        turns = f" P{draw.choice((1, 2, 3, 3, 0, 1.5))}" if draw.random() < 0.2 else ""
        across = f" {z}{self.number(5)}" if draw.random() < 0.3 else ""
        across += f" {self.words(self.rotary, 1)}" if draw.random() < 0.1 and self.rotary else ""
        if draw.random() < 0.15:
            return f"{plane} {word} {i}{self.number()} {j}{self.number()}{turns}{across}{feed}"
        a, b = -radius * math.cos(begin), -radius * math.sin(begin)
        outer = radius + draw.choice(MISSED)
        u, v = a + outer * math.cos(begin + turn), b + outer * math.sin(begin + turn)
        if draw.random() < 0.4:
            half = math.hypot(u, v) / 2.0
            size = (half - draw.choice((0.0, 0.001, 0.003))) if draw.random() < 0.3 else radius
            centre = f"R{draw.choice((1, 1, -1)) * size:.5f}"
        else:
            centre = f"{i}{a:.5f} {j}{b:.5f}"
        return f"{plane} G91 {word} {x}{u:.5f} {y}{v:.5f} {centre}{turns}{across}{feed}"

    def cycle(self) -> str:
        """Return a drilling cycle."""
        draw = self.draw
        word = draw.choice(
            ("G81", "G81", "G82", "G83", "G73", "G85", "G86", "G89", "G84", "G74", "G88", "G87")
        )
        extra = {"G82": " P0.5", "G86": " P0.5", "G89": " P0.5", "G83": " Q1.5", "G73": " Q1.5"}.get(word, "")
        level = f" {draw.choice(('G98', 'G99'))}" if draw.random() < 0.8 else ""
        count = f" L{draw.choice((1, 2, 3))}" if draw.random() < 0.2 else ""
        turned = f" {self.words(self.rotary, 1)}" if draw.random() < 0.1 and self.rotary else ""
        again = f"\n{self.words('XY', 2)}" if draw.random() < 0.4 else ""
        end = "\nG80" if draw.random() < 0.8 else ""
        depth = f"Z{draw.uniform(-9, -1):.2f} R{draw.uniform(0.5, 5):.1f}"
        plane = "G17 " if draw.random() < 0.9 else ""
        return f"{plane}{word}{level} {self.words('XY', 2)} {depth}{extra}{count}{turned}{again}{end}"

    def shift(self) -> str:
        """Return a block that changes what words count from."""
        words = self.words("XYZ" + self.rotary, 2)
        choices = ("G92 ", "G92 ", "G52 ", "G10 L2 P1 ", "G10 L20 P1 ")
        plain = (
            "G92.1",
            "G92.2",
            "G92.3",
            "G54",
            "G55",
            "G59.1",
            "G43 H1",
            "G49",
            "G43.1 Z0",
            "G52 X0 Y0 Z0",
        )
        if self.draw.random() < 0.5:
            return self.draw.choice(choices) + words
        return self.draw.choice(plain)

    def mode(self) -> str:
        """Return a block that changes modes."""
        modes = ("G90", "G91", "G17", "G18", "G19", "G93", "G94", "G95", "G94 F50", "G95 F0.2", "G80", "G98")
        more = ("G99", "G90.1", "G91.1", "G20", "G21", "S1200", "G64 P0.1", "G61", "F12.5", "M5", "G93\nG94")
        return self.draw.choice(modes + more)

    def dwell(self) -> str:
        """Return a dwell."""
        return f"G4 P{self.draw.choice((0, 0.5, 2, 1.25))}"

    def value(self, depth: int = 2) -> str:
        """Return an expression in brackets."""
        draw = self.draw
        if depth == 0:
            return draw.choice(
                (f"{draw.randint(0, 9)}", f"-{draw.randint(1, 9)}", f"{draw.uniform(-3, 3):.2f}", "#1")
            )
        chance = draw.random()
        if chance < 0.25:
            return f"{draw.choice(FUNCTIONS[:-3])}[{self.value(depth - 1)}]"
        if chance < 0.35:
            return f"ATAN[{self.value(depth - 1)}]/[{self.value(depth - 1)}]"
        return f"[{self.value(depth - 1)} {draw.choice(OPERATORS)} {self.value(depth - 1)}]"

    def expression(self) -> str:
        """Return a move to what an expression says."""
        draw = self.draw
        if draw.random() < 0.2:
            near = draw.choice((0.0, 1e-7, 0.00005, 0.00009, 0.00011, 0.01))
            return (
                f"G1 X[[{draw.randint(0, 9)} + {near:.7f}] {draw.choice(OPERATORS[9:])} {draw.randint(0, 9)}]"
            )
        assigned = f"#1=[{self.value()}]\n" if draw.random() < 0.4 else "#1=2\n"
        return f"{assigned}G1 {draw.choice('XYZ')}[{self.value()}] F100"

    def branch(self) -> None:
        """Write a loop, a branch or a subroutine about some blocks."""
        draw, self.names = self.draw, self.names + 1
        name, count = draw.choice((f"o{self.names}00", f"o<part{self.names}>")), draw.randint(0, 3)
        variable = f"#{10 + self.names}"
        heads = {
            "repeat": ([f"{name} repeat [{count}]"], [f"{name} endrepeat"]),
            "while": (
                [f"{variable}=0", f"{name} while [{variable} LT {count}]", f"{variable}=[{variable} + 1]"],
                [f"{name} endwhile"],
            ),
            "do": (
                [f"{variable}=0", f"{name} do", f"{variable}=[{variable} + 1]"],
                [f"{name} while [{variable} LT {count}]"],
            ),
            "if": (
                [f"{name} if [{self.value()}]"],
                [f"{name} else", f"G1 X{self.number()} F80", f"{name} endif"],
            ),
            "elseif": (
                [f"{name} if [{count} EQ 1]"],
                [f"{name} elseif [{count} EQ 2]", f"G1 Y{self.number()} F80", f"{name} endif"],
            ),
            "sub": (
                [f"{name} sub"],
                ["G1 X#1 Y#2 F60", f"{name} endsub", f"{name} call [{count}] [{self.number()}]"],
            ),
        }
        head, tail = heads[draw.choice(list(heads))]
        self.lines += head
        self.some(draw.randint(1, 2))
        if draw.random() < 0.15:
            self.lines.append(f"{name} {draw.choice(('break', 'continue'))}")
        self.lines += tail


def program(seed: int, rotary: str = "AC") -> str:
    """Return the program of a seed."""
    return Writer(seed, rotary).text()
