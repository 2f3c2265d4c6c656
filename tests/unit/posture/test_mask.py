"""Masks of postures: what is asked, and what is refused in addition."""

import numpy as np

import fiveaxis as fx
from fiveaxis.posture.mask import RADIUS, Mask, Spots

ROWS = np.array([3, 3, 4])


def test_a_spot_is_refused_with_what_is_near_it_at_its_location_alone():
    spots = Spots()
    mask = Mask().refusing(spots)
    spots.add(np.array([3]), np.array([[0.2, -0.4]]))
    near = np.array([[0.2 + 0.9 * RADIUS, -0.4], [0.2 + 1.1 * RADIUS, -0.4], [0.2, -0.4]])
    assert mask.admits(ROWS, near).tolist() == [False, True, True]
    assert mask.roughly_admits(ROWS, near).tolist() == [False, True, True]


def test_postures_a_whole_turn_apart_are_the_same_spot():
    spots = Spots()
    spots.add(np.array([3]), np.array([[0.2, -0.4]]))
    turned = np.array([[0.2 + 4.0 * np.pi, -0.4], [0.2 - 2.0 * np.pi, -0.4], [0.2, 0.0]])
    assert Mask().refusing(spots).admits(ROWS, turned).tolist() == [False, False, True]


def test_a_location_that_comes_up_again_is_refused_twice_as_widely():
    spots = Spots()
    for _ in range(2):
        spots.add(np.array([3]), np.array([[0.0, 0.0]]))
    postures = np.array([[1.9 * RADIUS, 0.0], [2.1 * RADIUS, 0.0], [0.0, 0.0]])
    assert Mask().refusing(spots).admits(ROWS, postures).tolist() == [False, True, True]


def test_the_mask_itself_is_asked_beside_spots_only():
    asked, spots = [], Spots()

    def exact(rows, rotary):
        asked.extend(rows.tolist())
        return rotary[:, 0] < 0.5

    mask = Mask(exact, lambda rows, rotary: rotary[:, 0] < 0.4).refusing(spots)
    spots.add(np.array([3]), np.array([[0.0, 0.0]]))
    postures = np.array([[0.0, 0.0], [0.45, 0.0], [0.6, 0.0]])
    assert mask.admits(ROWS, postures).tolist() == [False, True, False]
    assert asked == [3, 4]
    assert mask.roughly_admits(ROWS, postures).tolist() == [False, False, False]


def test_both_masks_have_to_admit_a_posture_roughly_too():
    first = Mask(lambda _, rotary: rotary[:, 0] > 0.0, lambda _, rotary: rotary[:, 0] > 0.1)
    both = first.within(Mask(lambda _, rotary: rotary[:, 1] > 0.0))
    postures = np.array([[0.05, 1.0], [0.5, -1.0], [0.5, 1.0]])
    assert both.admits(ROWS, postures).tolist() == [True, False, True]
    assert both.roughly_admits(ROWS, postures).tolist() == [False, False, True]


def test_at_an_inserted_location_both_neighbours_have_to_admit_a_posture():
    mask = Mask(lambda rows, rotary: rotary[:, 0] < rows).along(np.array([0.0, 0.5, 1.0]))
    assert mask.admits(np.arange(3), np.full((3, 2), 0.5)).tolist() == [False, False, True]


def test_halfway_on_a_move_past_other_locations_the_one_in_the_middle_admits_a_posture():
    mask = Mask(lambda rows, rotary: rotary[:, 0] == rows).halfway(np.array([0.0, 8.0, 9.0]))
    # Locations 0, 8 and 9 with location 4 and the way from 8 to 9 between them.
    postures = np.array([[0.0, 0.0], [4.0, 0.0], [8.0, 0.0], [8.0, 0.0], [9.0, 0.0]])
    assert mask.admits(np.arange(5), postures).tolist() == [True, True, True, False, True]


def test_a_mask_counts_angles_as_the_machine_does():
    machine = fx.load_machine("hayashi-640123")
    low, high = (getattr(machine, end)[machine.rotary_columns] for end in ("low", "high"))
    mask = Mask(lambda _, rotary: ((low <= rotary) & (rotary <= high)).all(axis=1))
    unwrapped = np.array([[2.0 * np.pi if np.isfinite(end) else 0.0 for end in high]])
    assert not mask.admits(np.array([0]), unwrapped).any()
    assert mask.wrapped(machine).admits(np.array([0]), unwrapped).all()
