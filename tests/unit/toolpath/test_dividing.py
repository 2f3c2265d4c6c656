"""Moves are divided into as many parts as they need, within what fits a computer."""

import numpy as np
import pytest

from fiveaxis.errors import ToolpathError
from fiveaxis.toolpath import divided_rows, part_places
from fiveaxis.toolpath.dividing import MOST_IN_ALL, MOST_PARTS


def test_parts_are_even_and_the_given_rows_are_among_them():
    np.testing.assert_allclose(divided_rows(np.array([1, 4, 2])), [0, 1, 1.25, 1.5, 1.75, 2, 2.5, 3])


def test_a_move_that_would_fill_the_memory_is_refused_by_its_number():
    with pytest.raises(ToolpathError, match=r"the worst, move 2, into 200001 \(at most 200000 each"):
        part_places(np.array([1, MOST_PARTS + 1, 1]))


def test_many_long_moves_are_refused_together():
    parts = np.full(MOST_IN_ALL // MOST_PARTS + 1, MOST_PARTS)
    with pytest.raises(ToolpathError, match="divided into 10200000 parts"):
        part_places(parts)


def test_a_long_path_of_undivided_moves_is_no_such_case():
    assert len(part_places(np.ones(MOST_IN_ALL + 5, dtype=np.int64))[0]) == MOST_IN_ALL + 5
