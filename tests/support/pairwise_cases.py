"""Some of many cases, in which every pair of values that goes together comes at least once."""

from collections import defaultdict
from collections.abc import Hashable, Iterable
from itertools import combinations, product

import pytest

Case = tuple[Hashable, ...]
# Two values of a case, each with its place in it.
Pair = tuple[tuple[int, Hashable], ...]


def pairwise_cover(cases: Iterable[Case]) -> list[Case]:
    """Pick cases so that each pair of values of any case is in a picked one, always the same ones.

    A fault that only three values together show is rare, and a whole product asks the same of each pair many
    times. Pairs of few cases are served first: by the case that has the most pairs still missing.
    """
    having: dict[Pair, list[Case]] = defaultdict(list)
    for case in cases:
        for pair in pairs_of(case):
            having[pair].append(case)
    missing = dict.fromkeys(sorted(having, key=lambda pair: len(having[pair])))
    picked = []
    while missing:
        rarest = next(iter(missing))
        best = max(having[rarest], key=lambda case: sum(pair in missing for pair in pairs_of(case)))
        picked.append(best)
        for pair in pairs_of(best):
            missing.pop(pair, None)
    return picked


def in_pairs(**values: Iterable[Hashable]) -> pytest.MarkDecorator:
    """Give a test so many combinations of its parameters' values that each pair of values comes."""
    return pytest.mark.parametrize(tuple(values), pairwise_cover(product(*values.values())))


def pairs_of(case: Case) -> Iterable[Pair]:
    return combinations(enumerate(case), 2)
