"""Seeded damage of inputs: of bytes, of lines, of words, and mixes of the words of several files."""

import random
import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

WORDS = re.compile(rb"[A-Za-z_]+|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|\s+|.", re.DOTALL)
NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
NUMBERS = [
    *(b"0", b"-0", b"1", b"-1", b".", b"-", b"+", b"1.", b".5", b"3", b"7", b"45", b"90", b"-360", b"1e9"),
    *(b"1e-9", b"99999", b"2147483648", b"4294967295", b"-2147483649", b"18446744073709551616", b"1e308"),
    *(b"1e309", b"-1e-320", b"1e5000", b"nan", b"inf", b"-inf", b"1_0", b"0x1F", b"1,5", b"1e", b"--1"),
    *("٣".encode(), b"0.1.2", b"1" * 400, b"0." + b"3" * 300),
]
STRANGE = [
    *(
        b"\0",
        b"\x1a",
        b"\xff",
        b"\xfe\xff",
        b"\xef\xbb\xbf",
        b"\r",
        b"\n",
        b"\r\n",
        b"\t",
        b"\x0c",
        b"\x1b[2J",
    ),
    *(
        "\u2028".encode(),
        "é".encode(),
        "ß".encode(),
        "İ".encode(),
        "ﬁ".encode(),
        "𝟛".encode(),
        b"\xed\xa0\x80",
    ),
    *(
        b'"',
        b"'",
        b'"""',
        b"'''",
        b"(",
        b")",
        b"[",
        b"]",
        b"{",
        b"}",
        b"[[",
        b";",
        b":",
        b",",
        b"/",
        b"%",
        b"=",
    ),
    *(b"$", b"#", b"\\", b"*", b"=", b" ", b"^", b"|", b"&", b"<", b">", b"@", b"!", b"~", b"`", b"?"),
]
# Numbers of a binary format, little end first.
PACKED = [
    *(struct.pack("<f", value) for value in (0.0, 1.0, -1.0, 1e38, -1e38, 1e-40, float("nan"), float("inf"))),
    *(struct.pack("<I", value) for value in (0, 1, 3, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1)),
]
LONG = 20_000


@dataclass(frozen=True)
class Seeds:
    """Inputs that a reader accepts, to be damaged.

    Parameters
    ----------
    contents : whole inputs
    words : further words of the format, which no content may have
    binary : whether to damage bytes only
    """

    contents: tuple[bytes, ...]
    words: tuple[bytes, ...] = ()
    binary: bool = False

    @cached_property
    def lines(self) -> list[bytes]:
        """All different lines."""
        return sorted({line for content in self.contents for line in content.split(b"\n")})

    @cached_property
    def vocabulary(self) -> list[bytes]:
        """All different words."""
        return sorted({*self.words, *(word for content in self.contents for word in WORDS.findall(content))})

    def make(self, rng: random.Random) -> bytes:
        """Make an input: one of the seeds with damage, or a mix of their words."""
        if not self.binary and rng.random() < 0.1:
            return self._mix(rng)
        content = rng.choice(self.contents)
        kinds = BINARY if self.binary else TEXT
        for _ in range(1 + min(int(rng.expovariate(0.8)), 8)):
            content = rng.choice(kinds)(content, self, rng)
        if rng.random() < 0.005:
            content = _blow_up(content, self, rng)
        return content

    def _mix(self, rng: random.Random) -> bytes:
        """Mix words at random: lines that keep the format's words and nothing else."""
        return b"\n".join(
            b"".join(_word(self, rng) for _ in range(rng.randrange(12))) for _ in range(rng.randrange(1, 12))
        )


Damage = Callable[[bytes, Seeds, random.Random], bytes]


def _word(seeds: Seeds, rng: random.Random) -> bytes:
    kind = rng.random()
    if kind < 0.6:
        return rng.choice(seeds.vocabulary)
    return rng.choice(NUMBERS) if kind < 0.85 else rng.choice(STRANGE)


def _flip(content: bytes, _: Seeds, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _n in range(rng.randrange(1, 4) if changed else 0):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def _cut(content: bytes, _: Seeds, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] if rng.random() < 0.7 else content[at:]


def _drop(content: bytes, _: Seeds, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + content[at + rng.randrange(1, 40) :]


def _insert(content: bytes, seeds: Seeds, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + _word(seeds, rng) + content[at:]


def _splice(content: bytes, seeds: Seeds, rng: random.Random) -> bytes:
    other = rng.choice(seeds.contents)
    return content[: rng.randrange(len(content) + 1)] + other[rng.randrange(len(other) + 1) :]


def _pack(content: bytes, _: Seeds, rng: random.Random) -> bytes:
    at = rng.randrange(max(1, len(content) - 3))
    return content[:at] + rng.choice(PACKED) + content[at + 4 :]


def _on_lines(change: Callable[[list[bytes], Seeds, random.Random], object]) -> Damage:
    def damage(content: bytes, seeds: Seeds, rng: random.Random) -> bytes:
        lines = content.split(b"\n")
        change(lines, seeds, rng)
        return b"\n".join(lines)

    return damage


def _repeat_line(lines: list[bytes], _: Seeds, rng: random.Random) -> None:
    at = rng.randrange(len(lines))
    lines[at:at] = [lines[at]] * rng.randrange(1, 4)


def _drop_line(lines: list[bytes], _: Seeds, rng: random.Random) -> None:
    del lines[rng.randrange(len(lines))]


def _swap_lines(lines: list[bytes], _: Seeds, rng: random.Random) -> None:
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]


def _add_line(lines: list[bytes], seeds: Seeds, rng: random.Random) -> None:
    lines.insert(rng.randrange(len(lines) + 1), rng.choice(seeds.lines))


def _on_words(change: Callable[[list[bytes], Seeds, random.Random], object]) -> Damage:
    def damage(lines: list[bytes], seeds: Seeds, rng: random.Random) -> None:
        at = rng.randrange(len(lines))
        words = WORDS.findall(lines[at])
        if words:
            change(words, seeds, rng)
            lines[at] = b"".join(words)

    return _on_lines(damage)


def _replace_word(words: list[bytes], seeds: Seeds, rng: random.Random) -> None:
    words[rng.randrange(len(words))] = _word(seeds, rng)


def _swap_words(words: list[bytes], _: Seeds, rng: random.Random) -> None:
    one, other = rng.randrange(len(words)), rng.randrange(len(words))
    words[one], words[other] = words[other], words[one]


def _repeat_word(words: list[bytes], _: Seeds, rng: random.Random) -> None:
    words.insert(rng.randrange(len(words) + 1), rng.choice(words))


def _replace_number(words: list[bytes], _: Seeds, rng: random.Random) -> None:
    at = [i for i, word in enumerate(words) if NUMBER.fullmatch(word)]
    if at:
        words[rng.choice(at)] = rng.choice(NUMBERS)


def _blow_up(content: bytes, seeds: Seeds, rng: random.Random) -> bytes:
    """Insert a word many times: long lines, deep brackets, integers of thousands of digits."""
    word = rng.choice([b"[", b"{a=", b"(", b"1", b"a.", b" ", b"-", b"\\", b'"', b"\n", _word(seeds, rng)])
    at = rng.randrange(len(content) + 1)
    return content[:at] + word * min(5000, LONG // len(word)) + content[at:]


BINARY: Sequence[Damage] = (_flip, _cut, _drop, _splice, _pack, _pack, _pack)
TEXT: Sequence[Damage] = (
    *(_flip, _cut, _drop, _insert, _insert, _splice),
    *map(_on_lines, (_repeat_line, _drop_line, _swap_lines, _add_line, _add_line)),
    *map(_on_words, (_replace_word, _replace_word, _swap_words, _repeat_word)),
    *map(_on_words, (_replace_number, _replace_number, _replace_number)),
)
