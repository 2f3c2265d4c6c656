"""Where on its edge a cutter cuts, against closed forms, and the bound on the speed of the edge."""

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.model import Constraints, Tool, Toolpath
from fiveaxis.model.toolpath.edge import EdgeUse, cut_lengths
from fiveaxis.model.toolpath.edge import admitted as admitted_angles

RPM = 2.0 * np.pi / 60.0


def plane(n: int = 11, tool: Tool | None = None) -> Toolpath:
    """A straight line of 100 mm on a horizontal plane."""
    contact = np.stack([np.linspace(0.0, 100.0, n), np.zeros(n), np.zeros(n)], axis=1)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), tool or Tool.ball(10))


def leaning(degrees) -> np.ndarray:
    turn = np.radians(np.asarray(degrees, dtype=float))
    return np.stack([0 * turn, np.sin(turn), np.cos(turn)], axis=1)


def test_a_ball_at_a_constant_lean_on_a_plane_cuts_in_one_bin():
    use = EdgeUse.of({"one": (plane(), leaning([32.0] * 11))}, 8000 * RPM)
    np.testing.assert_allclose(np.degrees(use.edges), [30.0, 35.0])
    np.testing.assert_allclose(use.lengths["one"], [100.0])
    np.testing.assert_allclose(use.diameters, 10.0 * np.sin(use.edges))
    np.testing.assert_allclose(60e-3 * use.speeds, np.pi * 10.0 * np.sin(use.edges) * 8000 / 1000)
    assert use.unknown == {"one": 0.0}


def test_an_even_swing_spreads_the_length_evenly_over_the_edge():
    coarse, fine = (plane(n) for n in (2, 1001))
    for path in (coarse, fine):
        use = EdgeUse.of({"swing": (path, leaning(np.linspace(0.0, 60.0, len(path))))})
        np.testing.assert_allclose(use.lengths["swing"], 100.0 / 12.0, rtol=1e-6)
        assert use.speeds is None


def test_links_don_t_count_and_cuts_of_unknown_contact_are_told_apart():
    links = np.zeros(11, dtype=bool)
    links[5:7] = True
    path = plane().with_links(links)
    use = EdgeUse.of({"one": (path, leaning([32.0] * 11))})
    told = use.lengths["one"].sum() + use.unknown["one"]
    assert told == pytest.approx(80.0)
    assert use.unknown["one"] == pytest.approx(10.0)  # from the link's end to the first contact


@pytest.mark.parametrize(
    ("given", "low", "high"),
    [
        ({"tilt": (15.0, 75.0)}, 15.0, 75.0),
        ({"tilt": (2.0, 40.0), "lead": (10.0, 20.0)}, 10.0, 40.0),
        # Lead and lean together turn the axis by atan hypot(tan 30°, tan 20°).
        ({"lead": (-30.0, 30.0), "lean": (-20.0, 20.0)}, 0.0, 34.31),
    ],
)
def test_angles_are_admitted_that_all_bounds_admit_at_once(given, low, high):
    bounds = Constraints.of_degrees(**given).lean_bounds(plane())
    np.testing.assert_allclose(np.degrees(admitted_angles(plane(), bounds)), [low, high], atol=0.6)


def test_without_normals_nothing_is_told_or_bounded():
    tips = np.stack([np.linspace(0.0, 10.0, 5), np.zeros(5), np.zeros(5)], axis=1)
    path = Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (5, 1)), Tool.ball(10))
    with pytest.raises(ToolpathError, match="no surface normals"):
        EdgeUse.of({"one": (path, path.axis)})
    bounds = Constraints.of_degrees(cone=20.0, least_cutting_speed=60.0, spindle_speed=8000.0)
    with pytest.raises(ToolpathError, match="no surface normals"):
        bounds.lean_bounds(path)


@pytest.mark.parametrize("speed", [20.0, 60.0, 120.0, 250.0])
def test_the_bound_is_the_angle_at_which_a_ball_cuts_that_fast(speed):
    """π D sin φ n = v."""
    path, given = plane(), {"least_cutting_speed": speed, "spindle_speed": 8000.0}
    bounds = Constraints.of_degrees(tilt=(0.0, 90.0), **given).lean_bounds(path)
    angle = np.degrees(np.arcsin(1000.0 * speed / (np.pi * 10.0 * 8000.0)))
    for off, admitted in ((0.01, True), (-0.01, False)):
        assert bounds.admits(leaning([angle + off] * 11)).all() == admitted
    use = EdgeUse.of({"one": (path, leaning([angle] * 11))}, 8000 * RPM)
    assert 60e-3 * use.speeds[0] <= speed <= 60e-3 * use.speeds[1]


def test_a_bull_nose_is_bounded_by_its_corner():
    """Its contact is at a + r sin φ: here 4 + 2 sin φ mm."""
    path = plane(tool=Tool.bull(12, 2))
    bounds = Constraints.of_degrees(tilt=(5.0, 80.0), least_cutting_speed=np.pi * 10.0, spindle_speed=1000.0)
    bound = bounds.lean_bounds(bounds.zoned(path))
    assert bound.admits(leaning([31.0] * 11)).all()
    assert not bound.admits(leaning([29.0] * 11)).any()


def test_a_speed_out_of_reach_or_without_a_spindle_is_refused():
    with pytest.raises(SettingError, match="spindle_speed"):
        Constraints.of_degrees(tilt=(0.0, 90.0), least_cutting_speed=60.0)
    fast = Constraints.of_degrees(tilt=(0.0, 90.0), least_cutting_speed=60.0, spindle_speed=1000.0)
    with pytest.raises(SettingError, match=r"31\.42 m/min"):
        fast.lean_bounds(plane())
    narrow = Constraints.of_degrees(tilt=(0.0, 10.0), least_cutting_speed=60.0, spindle_speed=8000.0)
    with pytest.raises(SettingError, match=r"13\.81 deg"):
        narrow.lean_bounds(plane())


def test_a_cutting_speed_bounds_the_lean_also_where_nothing_else_does():
    assert Constraints.of_degrees(least_cutting_speed=60.0, spindle_speed=8000.0).bounds_lean


def test_unevenness_is_how_far_a_mm_of_cut_is_from_even_use():
    use = EdgeUse.of({"one": (plane(), leaning([32.0] * 11))}, within=(np.radians(15.0), np.radians(75.0)))
    np.testing.assert_allclose(np.degrees(use.edges[[0, -1]]), [15.0, 75.0])
    assert use.as_dict()["peak_over_mean"] == {"one": pytest.approx(12.0)}
    # Within a bin nothing is told apart: from 30 or 35 deg to 15…75 it is 18 and a bit.
    assert np.degrees(use.unevenness["one"]) == pytest.approx(17.0, abs=1.5)


def test_each_cut_counts_half_for_either_of_its_ends():
    path = plane().at(np.array([0, 1, 4, 6]))
    np.testing.assert_allclose(cut_lengths(path), [5.0, 20.0, 25.0, 10.0])
