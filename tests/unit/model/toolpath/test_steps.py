"""Tables along a path: rows taken, joined, and turned round by one rule."""

from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Array, BoolArray
from fiveaxis.model import PER_LOCATION, StepTable, per_step


@dataclass(frozen=True, eq=False)
class Table(StepTable):
    """One field of each kind, on a path of `n` locations."""

    name: str
    at: Array = field(metadata=PER_LOCATION)
    length: Array = field(metadata=per_step())
    up: Array = field(metadata=per_step(spread=1, opposite="down"))
    down: Array = field(metadata=per_step(spread=1, opposite="up"))
    cuts: BoolArray = field(metadata=per_step())
    both: Array | None = field(default=None, metadata=per_step(axis=1, spread=2))


def table() -> Table:
    steps = np.arange(1.0, 6.0)
    both = np.stack([steps, 10.0 * steps])[:, :, None]
    return Table("path", np.arange(6.0), steps, 2.0 * steps, 3.0 * steps, steps > 4.0, both)


def test_joined_steps_are_summed_averaged_or_true_where_one_is():
    few = table().thinned(np.array([0, 2, 5]))
    assert few.name == "path"
    assert few.at.tolist() == [0.0, 2.0, 5.0]
    assert few.length.tolist() == [3.0, 12.0]
    assert few.up.tolist() == [3.0, 8.0]
    assert few.cuts.tolist() == [False, True]
    np.testing.assert_allclose(few.both[..., 0], [[3.0 / 4.0, 12.0 / 9.0], [30.0 / 4.0, 120.0 / 9.0]])
    assert len(table().thinned(np.array([3])).length) == 0


def test_a_part_has_the_locations_at_both_ends_and_the_steps_between():
    part = table().between(1, 3)
    assert part.at.tolist() == [1.0, 2.0, 3.0]
    assert part.length.tolist() == [2.0, 3.0]
    assert part.both[0, :, 0].tolist() == [2.0, 3.0]


def test_on_the_way_back_what_grew_falls():
    back = table().backwards()
    assert back.at.tolist() == [5.0, 4.0, 3.0, 2.0, 1.0, 0.0]
    assert back.up.tolist() == (3.0 * np.arange(5.0, 0.0, -1.0)).tolist()
    assert back.down.tolist() == (2.0 * np.arange(5.0, 0.0, -1.0)).tolist()
    assert back.both[0, :, 0].tolist() == (10.0 * np.arange(5.0, 0.0, -1.0)).tolist()
    again = back.backwards()
    for name in ("at", "length", "up", "down", "cuts", "both"):
        np.testing.assert_array_equal(getattr(again, name), getattr(table(), name))
    assert (
        Table(*[getattr(back, n) for n in ("name", "at", "length", "up", "down", "cuts")]).backwards().both
        is None
    )
