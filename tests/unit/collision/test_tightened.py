"""A mask that refuses postures found to collide."""

import numpy as np

from fiveaxis.collision.tightened import RADIUS, Tightened

ROWS = np.array([3, 3, 4])


def test_a_posture_that_collides_is_refused_with_those_near_it_at_its_location_alone():
    mask = Tightened()
    mask.refuse(np.array([3]), np.array([[0.2, -0.4]]))
    near = np.array([[0.2 + 0.9 * RADIUS, -0.4], [0.2 + 1.1 * RADIUS, -0.4], [0.2, -0.4]])
    assert mask(ROWS, near).tolist() == [False, True, True]
    assert mask.rough(ROWS, near).tolist() == [False, True, True]


def test_postures_a_whole_turn_apart_are_the_same():
    mask = Tightened()
    mask.refuse(np.array([3]), np.array([[0.2, -0.4]]))
    assert mask(
        ROWS, np.array([[0.2 + 4.0 * np.pi, -0.4], [0.2 - 2.0 * np.pi, -0.4], [0.2, 0.0]])
    ).tolist() == [
        False,
        False,
        True,
    ]


def test_a_location_that_comes_up_again_is_refused_twice_as_widely():
    mask = Tightened()
    for _ in range(2):
        mask.refuse(np.array([3]), np.array([[0.0, 0.0]]))
    postures = np.array([[1.9 * RADIUS, 0.0], [2.1 * RADIUS, 0.0], [0.0, 0.0]])
    assert mask(ROWS, postures).tolist() == [False, True, True]


def test_the_other_mask_decides_beside_the_spots_only():
    asked = []

    def exact(rows, rotary):
        asked.extend(rows.tolist())
        return rotary[:, 0] < 0.5

    mask = Tightened(exact, lambda rows, rotary: rotary[:, 0] < 0.4)
    mask.refuse(np.array([3]), np.array([[0.0, 0.0]]))
    postures = np.array([[0.0, 0.0], [0.45, 0.0], [0.6, 0.0]])
    assert mask(ROWS, postures).tolist() == [False, True, False]
    assert asked == [3, 4]
    assert mask.rough(ROWS, postures).tolist() == [False, False, False]
