"""M words: known ones, those that could change what positions mean, and unknown ones."""

import pytest

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.model import Machine, Tool
from fiveaxis.nc import read_toolpath
from fiveaxis.nc.options import ReadOptions

MACHINE = Machine.from_code("640123")
# A real post's order: TCP on by the machine builder's word, tips, and off again.
TIPS = "G21 G90 G94\n{on}\nG0 X0 Y0 Z50 A0 C0\nG1 Z0 F500\nG1 X10 Y5 A{a} C20\n{off}\nM30\n"


@pytest.fixture
def read(tmp_path):
    def read_text(text, name="part.nc", **options):
        path = tmp_path / name
        path.write_text(text)
        return read_toolpath(path, tool=Tool.ball(6), machine=MACHINE, **options)

    return read_text


def test_a_word_that_switches_tcp_elsewhere_is_refused_unless_it_is_called_harmless(read):
    text = TIPS.format(on="M451", off="M450", a=10)
    with pytest.raises(
        ToolpathError, match=r"part.nc:2: M451 switches tool centre point control \(TCP\) on: some"
    ):
        read(text)
    path = read(text, harmless=("M451", "M450"))
    assert path.ignored["M451"] == 1
    assert path.tips(path.axis)[-1].round(6).tolist() != [10, 5, 0]


def test_m128_in_iso_text_switches_tcp_and_is_refused_on_a_sinumerik(read):
    text = TIPS.format(on="M128", off="M129", a=10)
    path = read(text)
    assert path.tips(path.axis)[-1].round(9).tolist() == [10, 5, 0]
    with pytest.raises(ToolpathError, match=r"part.mpf:3: M128 .* isn't a word of Sinumerik 840D"):
        read("G710 G90 G94\nTRAFOOF\nM128\nG1 X0 Y0 Z0 A0 C0 F100\n", "part.mpf")
    with pytest.raises(ToolpathError, match="M144 contains the tilted axes"):
        read("0 BEGIN PGM A MM\n1 L M144\n2 END PGM A MM\n")


def test_an_unknown_word_is_an_error_where_it_could_have_switched_tcp(read):
    with pytest.raises(
        ToolpathError, match=r"part.nc:2: M777 isn't a known M word, and could .* line 5 has rotary"
    ):
        read(TIPS.format(on="M777", off="M778", a=10))
    [told] = [
        f for f in read("G43.4 H1\n" + TIPS.format(on="M777", off="M5", a=10)).findings if "M777" in f.message
    ]
    assert (told.code, told.place.line, told.value) == ("unknown-codes", 3, 1.0)
    # No axis turns: TCP on or off is the same.
    upright = read(TIPS.format(on="M777\nM777", off="M778", a=0).replace("C20", "C0"))
    [told] = [f for f in upright.findings if f.code == "unknown-codes"]
    assert told.message.startswith("M777 (2), M778 (1): M words that aren't known in ISO")
    assert told.place.line == 2
    assert "unknown-codes" not in {f.code for f in read(TIPS.format(on="M3", off="M09", a=10)).findings}


def test_harmless_takes_m_words_only():
    with pytest.raises(SettingError, match="harmless: 'G68' isn't an M word"):
        ReadOptions(harmless=("G68",))
