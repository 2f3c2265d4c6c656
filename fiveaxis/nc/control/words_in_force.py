"""Words that set something which neither rows nor offsets show: smoothing, tolerances, overrides, data.

A word is followed (its effect is in the rows, or in `fiveaxis.nc.control.technology`), stays in force until
another of its group takes its place, or acts once, where it stands. There is no fourth kind: what isn't
followed and belongs to no group acts once, and a check asks whether it may.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.iso import ALWAYS_OFF, TIP_WORDS

# Words of ISO 6983 that set something else than positions; all others that the interpreter takes are
# followed, or cancel what it refuses to switch on.
PLANES = ("G17", "G18", "G19")
# What switches TCP on one control is unknown, or another word, on the next.
TCP = frozenset((*TIP_WORDS, *ALWAYS_OFF, "G140", "G174"))
# Drilling, boring, tapping: a block that only names one has no row, and no place among cuts.
_CYCLES = frozenset(("G73", "G74", "G76", *(f"G{number}" for number in range(81, 90))))
_SETTING_G = (TCP | _CYCLES) | frozenset(
    (*PLANES, "G5.1", "G8", "G9", "G10", "G61", "G61.1", "G64", "G70", "G71", "G187", "G43", "G44", "G49")
)
_ENDS = frozenset(("M2", "M17", "M30", "M99"))
# Letters of a block without motion that belong to its G or M word.
_ARGUMENTS = "LPQRE"
# Words of other languages that are followed: frames, cycles that become moves, labels, normals.
_FOLLOWED = re.compile(
    r"PLANE .*|CYCL DEF (?:7|8|9|10|11|19|2[04][0-9])|TRANS DATUM|CC|Q12[0-2]|M128 F|TOOL CALL.*|T|=|FN [0-7]"
    r"|LBL|CALL|CALL (?:LBL|PGM)|REPEAT|UNTIL|(?:END)?(?:FOR|WHILE)|(?:BEGIN|END) PGM|CYCL CALL"
    r"|A?TRANS|A?ROT|MCALL|CYCLE(?:8[0-9]|840|800|76)|G8[14]|G5(?:00|0[5-9]|[1-9][0-9])|[ABC]4|OFFN|RNDM|label"
    # Reference moves are the machine moves of `technology`.
    r"|G74|G75|M92|M140|MB"
)
# Group -> its words. What has a value is a group by itself.
_GROUPS = {
    # Tool lengths act along the plane's third axis, even where no arc is written.
    "plane": "|".join(PLANES),
    "path mode": r"G6[0-4](?:\.1)?(?: .*)?|G64[1-6]",
    "compressor": r"COMP(?:ON|OF|CAD|CURV|SURF|PATH)",
    "length and TCP": r"(?:G4[349]|G43\.[45]|G234)(?: .*)?",
    "transformation": r"TRAORI.*|TRAFOOF|FUNCTION (?:RESET )?TCPM.*|L M12[89]|M42[89]|M12[89]",
    "orientation path": r"ORI(?:AXES|VECT|PLANE|PATHS?|CONTO)",
    "orientation frame": r"ORI(?:WKS|MKS)",
    "orientation angles": r"ORI(?:EULER|RPY2?|VIRT[12])",
    "orientation smoothing": r"ORISON|ORISOF",
    "orientation change": r"ORI[SCD]",
    "dynamics": r"DYN[A-Z]+",
    "feedforward": r"FFW(?:ON|OF)",
    "feed profile": r"FNORM|FLIN|FCUB|FPO.*",
    "rapid moves": r"RTLION",
    "feed group": r"FGROUP.*",
    "master spindle": r"SETMS.*",
    "overrides": r"M4[89]",
}
_GROUP_OF = re.compile("|".join(f"(?P<{name.replace(' ', '_')}>{p})" for name, p in _GROUPS.items()))
# Words that are groups by themselves, by what stands before their value.
_ALONE = re.compile(
    r"((?:[A-Z_]{2,}[0-9]*(?:\[[^\]]*\])?|variable #[0-9]{4,})(?==)|G5(?:\.1)?|G8|G187|CYCLE832"
    r"|CYCL DEF 3?32\.[0-9]|FUNCTION (?:S-PULSE|FEED|PROG PATH))(?![0-9]).*"
)
# What a control does anyway, or does again from there on.
_OFF = re.compile(
    r"COMPOF|TRAFOOF|G4[349](?: .*)?|FUNCTION RESET TCPM|L M129|ORISOF|DYNNORM|FNORM|FGROUP\(\)|SETMS"
    r"|OVR(?:RAP)?=100|(?:ADIS|ADISPOS|DL)=0|G5 P0|G5\.1 Q0|G8 P0|G187"
    r"|CYCLE832\((?:|0?\.?0*(?:,.*)?|[^,)]*,(?:0|_OFF)(?:,.*)?)\)"
    r"|CYCL DEF 3?32\.0.*|CYCL DEF 32\.1(?: T0*\.?0*)?"
    r"|FUNCTION (?:S-PULSE|FEED).* (?:RESET|OFF)|FUNCTION PROG PATH (?:IS TCP|OFF)"
)
# Spindle positions, and words of other spindles, act once.
_ONCE = re.compile(r"SPOSA?\b.*|[SMHTD][0-9]+=.*")
_WRITES = re.compile(r"G10\b.*")


def words_beside(block: Block, followed: frozenset[str]) -> Iterator[str]:
    """Yield the words of a block that aren't followed, as written.

    Followed are words of spindle, coolant and tool, whose effect is read elsewhere.
    """
    values = [f"{c}{block.words[c]:g}" for c in _ARGUMENTS if c in block.words]
    for word in (*block.g, *block.m):
        acts = word in _SETTING_G if word[0] == "G" else word not in followed | _ENDS
        if acts:
            yield " ".join((word, *(() if word in PLANES else values)))
    yield from block.stated
    for word in block.ignored:
        is_read = word in followed or _FOLLOWED.fullmatch(word)
        if not is_read and not any(stated.startswith(word) for stated in block.stated):
            yield word


def group_of(word: str) -> str | None:
    """Return the group in which a word stays in force until another takes its place; None if it acts once."""
    if _ONCE.fullmatch(word):
        return None
    found = _GROUP_OF.fullmatch(word)
    if found is not None:
        return str(found.lastgroup)
    alone = _ALONE.fullmatch(word)
    if alone is not None:
        return alone[1]
    return word if _WRITES.fullmatch(word) else None


def in_force_after(words: tuple[str, ...], word: str, group: str) -> tuple[str, ...]:
    """Return the words in force after one of a group, in order of the alphabet."""
    others = [w for w in words if group_of(w) != group]
    return tuple(sorted(others if _OFF.fullmatch(word) else [*others, word]))
