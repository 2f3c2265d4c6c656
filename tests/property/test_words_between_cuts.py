"""Every word that a control's reader knows, put between two cuts: it is told, or known to be harmless."""

import re

import pytest
from planted.trial import PARTS, Trial, on_trunnion
from planted.vocabulary import WORDS
from planted.words import COMMENT

import fiveaxis as fx
from fiveaxis.nc import DIALECTS

# What moves nothing by itself before the next block says G1 again, dwells, sets what only arcs and cycles
# use or only their own block does, or ends what isn't on; the same in force by another name.
NOTHING_NEW = {
    "iso": "G0 G1 G2 G3 G4 G15 G50 G69 G80 G90.1 G91.1 G92.1 G92.2 G97 G98 G99 G255 G269 M13",
    "sinumerik": "G0 G1 G2 G3 G4 G53 G71 G153 G971 COMPOF DYNNORM FNORM ORISOF M13",
    "klartext": "M13 M137 CC PLANE|RESET|STAY CYCL|DEF|32.0|T5 CYCL|DEF|332.0|T5",
}
# Every twelfth word in the quick run, another part of them for each control.
STEP = 12
CONTROLS = [
    ("fanuc", "tip"),
    ("haas", "tip"),
    ("linuxcnc", "axes"),
    ("sinumerik", "tip"),
    ("heidenhain", "tip"),
]


@pytest.fixture(scope="module")
def solution() -> fx.Solution:
    """What is put between two cuts doesn't need a long path."""
    return on_trunnion(6)


def untold(control: str, mode: str, solution, folder, words: list[str]) -> list[str]:
    """Return the words of which nothing is told and that aren't harmless by the control's table."""
    trial = Trial.of(PARTS["trunnion"], solution, control, mode)
    before = trial.by_program(trial.text, folder)
    assert not before.errors
    known = "|".join(DIALECTS[control].harmless)
    head = [line for line in trial.text.lines[: trial.text.moves[0]] if not COMMENT.match(line)]
    nothing = {word for line in head for word in line.split() if word[0] != "H"}
    nothing |= {name.replace("|", " ") for name in NOTHING_NEW[WORDS[control].__name__].split()}
    return [
        word
        for word in words
        if not re.fullmatch(known, word)
        and not nothing & {word, word.split()[0], word.removeprefix("L ")}
        and not trial.by_program(trial.text.inserted(trial.subject.middle, word), folder).news(before)
    ]


@pytest.mark.parametrize(("control", "mode"), CONTROLS)
def test_some_words_between_cuts_are_told_or_harmless(control, mode, solution, tmp_path):
    begin = CONTROLS.index((control, mode))
    assert untold(control, mode, solution, tmp_path, WORDS[control]()[begin::STEP]) == []


@pytest.mark.slow
@pytest.mark.parametrize(("control", "mode"), CONTROLS)
def test_every_word_between_cuts_is_told_or_harmless(control, mode, solution, tmp_path):
    assert untold(control, mode, solution, tmp_path, WORDS[control]()) == []
