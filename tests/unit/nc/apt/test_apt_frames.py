"""Frames of APT files."""

import numpy as np
import pytest

from fiveaxis.base.errors import ToolpathError

PLAIN = "MSYS/0,0,0,1,0,0,0,1,0\n"
# Its x is the base's y, its y the base's x, its z points down.
DOWN = "MSYS/10,20,30,0,1,0,1,0,0\n"


def tips(path):
    return path.tips(path.axis)


def frame_codes(path):
    return [f.code for f in path.findings if f.code.startswith("frame-")]


def test_the_path_is_in_the_first_frame(read):
    path = read(DOWN + "GOTO/1,2,3,0,0,-1\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3]])
    np.testing.assert_allclose(path.axis, [[0, 0, -1]])
    assert frame_codes(path) == []


def test_frames_count_from_the_first_one_not_from_the_base(read):
    path = read(DOWN + "GOTO/0,0,0,0,0,1\n" + PLAIN + "GOTO/10,20,30,0,0,1\n" + DOWN + "GOTO/1,1,1,0,0,1\n")
    np.testing.assert_allclose(tips(path), [[0, 0, 0], [0, 0, 0], [1, 1, 1]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, 0, 1], [0, 0, -1], [0, 0, 1]], atol=1e-12)
    assert frame_codes(path) == ["frame-mapped", "frame-mapped"]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (
            "CSYS/1,0,0,0,0,1,0,0,0,0,1,0\n",
            "CSYS/0,1,0,10,1,0,0,20,0,0,-1,30\n",
        ),
        (
            "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n 0.0, 1.0, 0.0, 0.0, $\n 0.0, 0.0, 1.0, 0.0\n",
            "$$-> CSYS / 0.0, 1.0, 0.0, 10.0, $\n 1.0, 0.0, 0.0, 20.0, $\n 0.0, 0.0, -1.0, 30.0\n",
        ),
        (
            "$$*CATIA0\n$$ A\n$$ 1.0 0.0 0.0 0.0\n$$ 0.0 1.0 0.0 0.0\n$$ 0.0 0.0 1.0 0.0\n",
            "$$*CATIA0\n$$ A\n$$ 0.0 1.0 0.0 10.0\n$$ 1.0 0.0 0.0 20.0\n$$ 0.0 0.0 -1.0 30.0\n",
        ),
        (
            "MCS/1,0,0,0,1,0,0,0,1,0,0,0\n",
            "MCS/0,1,0,1,0,0,0,0,-1,$\n10,20,30\n",
        ),
    ],
)
def test_frames_of_other_systems_mean_the_same(read, first, second):
    path = read(first + "GOTO/1,2,3,0,0,1\n" + second + "GOTO/4,5,6,1,0,0\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [15, 24, 24]], atol=1e-12)
    np.testing.assert_allclose(path.axis[1], [0, 1, 0], atol=1e-12)


def test_frames_are_in_the_unit_of_the_file(read):
    path = read("UNITS/INCHES\n" + PLAIN + "GOTO/1,2,3\n" + "MSYS/1,0,0,1,0,0,0,1,0\n" + "GOTO/1,2,3\n")
    np.testing.assert_allclose(tips(path), [[25.4, 50.8, 76.2], [50.8, 50.8, 76.2]])


def test_world_coordinates_stay_where_they_are(read):
    frames = "TRNTYP/WORLD,0,0,0\nCSYS/1,0,0,0,0,1,0,0,0,0,1,0\n", "CSYS/0,0,1,0,1,0,0,0,0,1,0,0\n"
    path = read(frames[0] + "GOTO/1,2,3\n" + frames[1] + "GOTO/1,2,4,1,0,0\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [1, 2, 4]])
    assert frame_codes(path) == ["frame-unused"]


@pytest.mark.parametrize("word", ["TRNTYP/LOCAL", "TRNTYP"])
def test_other_types_of_coordinates_are_in_the_stated_frame(read, word):
    path = read(
        f"{word}\nCSYS/1,0,0,0,0,1,0,0,0,0,1,0\nGOTO/1,2,3\nCSYS/1,0,0,5,0,1,0,0,0,0,1,0\nGOTO/1,2,3\n"
    )
    np.testing.assert_allclose(tips(path)[1], [6, 2, 3])


def test_an_arc_within_a_later_frame_is_mapped_too(read):
    path = read(PLAIN + "GOTO/1,2,3\n" + DOWN + "GOTO/5,0,0\nCIRCLE/0,0,0,0,0,1,5\nGOTO/0,5,0\n")
    np.testing.assert_allclose(np.linalg.norm(tips(path)[1:] - [10, 20, 30], axis=1), 5, atol=1e-9)
    np.testing.assert_allclose(tips(path)[-1], [15, 20, 30], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "line", "fault"),
    [
        ("GOTO/1,2,3\n" + PLAIN + "GOTO/1,2,3\n", 2, "gives a frame after locations without one"),
        ("MSYS/0,0,0\nGOTO/1,2,3\n" + DOWN + "GOTO/1,2,3\n", 3, "changes the frame given on line 1"),
        (PLAIN + "GOTO/1,2,3\nMSYS/0,0,0,1,0,0,1,0,0\nGOTO/1,2,3\n", 3, "changes the frame"),
        (PLAIN + "GOTO/1,2,3\nMSYS/0,0,0,1,0,0,0,2,0\nGOTO/1,2,3\n", 3, "changes the frame"),
        (PLAIN + "GOTO/1,2,3\nMSYS/0,nan,0,1,0,0,0,1,0\nGOTO/1,2,3\n", 3, "changes the frame"),
        (PLAIN + "GOTO/1,2,3\nMSYS/A,0,0,1,0,0,0,1,0\nGOTO/1,2,3\n", 3, "changes the frame"),
        ("ORIGIN/0,0,0\nGOTO/1,2,3\nORIGIN/0,0,1\nGOTO/1,2,3\n", 3, "changes the frame"),
        ("ORIGIN/0,0,0\n" + PLAIN + "GOTO/1,2,3\n" + DOWN, 4, "changes the frame"),
        ("$$*CATIA0\n$$ A\n$$ 1 0 0 0\n$$ 0 1 0 0\nGOTO/1,2,3\n$$*CATIA0\n$$ A\n", 6, "changes the frame"),
        (PLAIN + "GOTO/1,2,3\n" + DOWN + "GODLTA/1,2,3\n", 4, "begins at a location of another frame"),
        (PLAIN + "GOTO/1,0,0\n" + DOWN + "CIRCLE/0,0,0,0,0,1\nGOTO/0,1,0\n", 4, "of another frame"),
    ],
)
def test_a_frame_that_cannot_be_mapped_is_refused(read, text, line, fault):
    with pytest.raises(ToolpathError, match=fault) as caught:
        read(text)
    assert caught.value.line == line
