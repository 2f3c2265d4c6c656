"""Former names: they work for a version, and say the present one."""

import pytest

import fiveaxis.contour
import fiveaxis.mesh
import fiveaxis.motion
import fiveaxis.posture
import fiveaxis.verification


@pytest.mark.parametrize(
    ("room", "old", "home", "new"),
    [
        (fiveaxis.contour, "load_mesh", fiveaxis.mesh, "load_mesh"),
        (fiveaxis.motion, "fill_in_rows", fiveaxis.motion, "fill_in"),
        (fiveaxis.posture, "Budget", fiveaxis.posture, "Effort"),
        (fiveaxis.posture, "Search", fiveaxis.posture, "LatticeSearch"),
        (fiveaxis.verification, "Asked", fiveaxis.verification, "PathConstraints"),
    ],
)
def test_a_former_name_is_the_present_one_with_a_warning(room, old, home, new):
    with pytest.warns(
        DeprecationWarning, match=f"{room.__name__}.{old} is now {home.__name__}.{new}"
    ) as told:
        assert getattr(room, old) is getattr(home, new)
    assert told[0].filename == __file__


def test_a_solution_that_was_wound_says_that_it_is_unwrapped():
    solution, kept = object.__new__(fiveaxis.posture.Solution), object()
    object.__setattr__(solution, "unwrapped", kept)
    with pytest.warns(DeprecationWarning, match=r"Solution\.wound is now Solution\.unwrapped"):
        assert solution.wound is kept


def test_a_name_that_never_was_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'dance'"):
        _ = fiveaxis.motion.dance
