"""No input brings a reader or a verb down: each is read, or refused by an error of our own."""

import pytest
from fuzzing.readers import Reader, readers
from fuzzing.trial import try_reader

# `tests/benchmarks/fuzz.py` gives each a hundred thousand.
COUNT = 40


# A process of Open Cascade reads each STEP file.
READERS = [pytest.param(r, id=r.name, marks=[pytest.mark.slow] * (r.name == "STEP")) for r in readers()]


@pytest.mark.parametrize("reader", READERS)
def test_damaged_inputs_are_read_or_refused_by_an_error_of_our_own(reader: Reader):
    outcome = try_reader(reader, COUNT)
    told = "\n".join(f"{content!r}\n{trace}" for content, trace in outcome.first.values())
    assert not outcome.foreign, told
    assert outcome.accepted + outcome.refused == outcome.inputs == max(1, round(COUNT * reader.share))
    assert outcome.seeds >= 0.5, "damage of what is refused anyway finds little"


def test_an_end_that_is_not_ours_is_told_with_its_input(monkeypatch):
    def faulty(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("fiveaxis.model.toolpath.tool.float", faulty, raising=False)
    reader = next(reader for reader in readers() if reader.name == "tool")
    with pytest.raises(ZeroDivisionError):
        reader.read(b"ball:10", None, None)
    outcome = try_reader(reader, 3 * COUNT)
    [(kind, (content, trace))] = outcome.first.items()
    assert kind.startswith("ZeroDivisionError at tool.py")
    assert outcome.foreign[kind] > 10
    assert content
    assert "faulty" in trace
