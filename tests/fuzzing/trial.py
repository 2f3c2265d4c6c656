"""Feed damaged inputs to one reader, and count how each ends."""

import random
import resource
import signal
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import fiveaxis
from fiveaxis.base.errors import FiveAxisError
from fuzzing.readers import Reader

# s: an input that keeps the processor longer, or the clock, is a foreign end too; a verb has longer.
MOST_BUSY, MOST_BUSY_VERB, MOST_WAIT = 10.0, 120.0, 600.0
MEGABYTE = 1 << 20
PACKAGE = Path(fiveaxis.__file__).parent
LONGEST_MESSAGE = 3000
# Of machines, options and columns: with one of so many an input without damage is read.
CHOICES = 10
# A folder in memory, where there is one: the inputs are files, and a disk is slower than the readers.
MEMORY = "/dev/shm" if Path("/dev/shm").is_dir() else None


class Endless(BaseException):
    """An input took too long."""


@dataclass
class Outcome:
    """How the inputs of a reader ended.

    Parameters
    ----------
    seeds : share of the inputs without damage that are read
    inputs, accepted, refused : number of all, of those read, and of those refused by an error of our own
    foreign : kind of every other end, by exception and place, to its number
    first : of each kind, the input and the traceback
    slowest : s of processor time, of one input
    memory : MB, the largest that the process came to have more than before
    """

    seeds: float = 0.0
    inputs: int = 0
    accepted: int = 0
    refused: int = 0
    foreign: dict[str, int] = field(default_factory=dict)
    first: dict[str, tuple[bytes, str]] = field(default_factory=dict)
    slowest: float = 0.0
    slowest_input: bytes = b""
    memory: float = 0.0


def try_reader(reader: Reader, count: int, seed: int = 0) -> Outcome:
    """Feed a reader its share of `count` damaged inputs, the same ones for the same seed.

    A warning is a foreign end, and so is a message without bound.
    """
    outcome, rng = Outcome(), random.Random(f"{reader.name} {seed}")
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder, warnings.catch_warnings(), _limited():
        warnings.simplefilter("error")
        home = Path(folder)
        for content in reader.seeds.contents:  # what is loaded once isn't an input's memory or time
            whole = Outcome()
            while whole.inputs < CHOICES and not whole.accepted:
                _try(reader, content, home, rng, whole)
            outcome.seeds += whole.accepted / len(reader.seeds.contents)
        before = _peak()
        for _ in range(max(1, round(count * reader.share))):
            _try(reader, reader.seeds.make(rng), home, rng, outcome)
        outcome.memory = _peak() - before
    return outcome


def _try(reader: Reader, content: bytes, home: Path, rng: random.Random, outcome: Outcome) -> None:
    outcome.inputs += 1
    start = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, MOST_BUSY if reader.share == 1.0 else MOST_BUSY_VERB)
    signal.setitimer(signal.ITIMER_REAL, MOST_WAIT)
    try:
        try:
            reader.read(content, home, rng)
            outcome.accepted += 1
        except FiveAxisError as fault:
            if len(str(fault)) > LONGEST_MESSAGE:
                raise AssertionError("a message without bound") from fault
            outcome.refused += 1
    except (Exception, Endless) as fault:
        kind = _kind(fault)
        outcome.foreign[kind] = outcome.foreign.get(kind, 0) + 1
        outcome.first.setdefault(kind, (content, "".join(traceback.format_exception(fault))))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    took = time.process_time() - start
    if took > outcome.slowest:
        outcome.slowest, outcome.slowest_input = took, content


def _kind(fault: BaseException) -> str:
    frames = traceback.extract_tb(fault.__traceback__)
    # A checkout's own folder may have the package's name, too.
    ours = [frame for frame in frames if Path(frame.filename).is_relative_to(PACKAGE)] or frames
    return f"{type(fault).__name__} at {Path(ours[-1].filename).name}:{ours[-1].lineno}"


@contextmanager
def _limited() -> Iterator[None]:
    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise Endless

    before = {number: signal.signal(number, stop) for number in (signal.SIGPROF, signal.SIGALRM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MEGABYTE
