"""Mechanistic milling forces: closed forms and quadratures of cuts."""

from dataclasses import replace

import numpy as np
import pytest
from cutting_forces import CuttingRecord, ForceCoefficients, cutting_record
from scipy.integrate import quad

from fiveaxis.base.errors import SettingError, ToolError
from fiveaxis.lab.cutting.cutting_forces import mean_cutting_power
from fiveaxis.lab.cutting.engagement import Cut, EndMill, removal_rate, swept_surface
from fiveaxis.posture.baselines.catalogue import leaned

# Figures of the size of a titanium alloy's; no paper's.
STEEL = ForceCoefficients(1800.0, 20.0, radial=700.0, axial=300.0, radial_edge=15.0, axial_edge=5.0)
SHARP = replace(STEEL, tangential_edge=0.0, radial_edge=0.0, axial_edge=0.0)
# Teeth enter and leave between two samples of the record: 720 a turn miss up to 1 % of a straight edge's cut,
# 0.3 % where helix or ball spread the entry.
STRAIGHT, SPREAD = 1e-2, 3e-3
# What the feed drives add to the spindle's power: of the order of feed over cutting speed, 0.8 % here.
DEGREE = np.pi / 180.0

FLAT = EndMill("flat", 10.0, teeth=3, helix=30.0 * DEGREE)
BALL = EndMill("ball", 10.0, teeth=2, helix=30.0 * DEGREE)
CUTS = {
    "flat slot": Cut(FLAT, 2.0, 10.0, 20.0, 500.0),
    "flat up": Cut(FLAT, 2.0, 3.0, 20.0, 500.0, "up"),
    "flat down": Cut(FLAT, 2.0, 7.0, 20.0, 500.0, "down"),
    "ball slot": Cut(BALL, 1.0, 10.0, 20.0, 500.0),
    "ball up": Cut(BALL, 2.0, 1.0, 20.0, 500.0, "up"),
    "ball down": Cut(BALL, 2.0, 4.0, 20.0, 500.0, "down"),
    "ball tilted": Cut(BALL, 1.0, 4.0, 20.0, 500.0, "down", lead=-20.0 * DEGREE, lean=10.0 * DEGREE),
    "ball far over": Cut(BALL, 0.5, 0.8, 20.0, 500.0, "up", lead=-35.0 * DEGREE, lean=45.0 * DEGREE),
}
every_cut = pytest.mark.parametrize("cut", CUTS.values(), ids=list(CUTS))


def mean_force(record: CuttingRecord) -> np.ndarray:
    return np.trapezoid(record.force, record.angle, axis=0) / (2.0 * np.pi)


def mean_torque(record: CuttingRecord) -> float:
    return np.trapezoid(record.torque, record.angle) / (2.0 * np.pi)


def mean_power(record: CuttingRecord) -> float:
    return np.trapezoid(record.power, record.angle) / (2.0 * np.pi)


@every_cut
def test_the_records_mean_power_is_the_closed_form(cut):
    record = cutting_record(cut, STEEL)
    assert mean_power(record) == pytest.approx(mean_cutting_power(cut, STEEL), rel=SPREAD)
    assert mean_torque(record) * cut.spindle / 1e3 == pytest.approx(mean_power(record))


@every_cut
def test_without_edge_forces_power_is_coefficient_times_removal_rate(cut):
    expected = SHARP.tangential * removal_rate(cut) / 1e3
    assert mean_cutting_power(cut, SHARP) == pytest.approx(expected, rel=1e-12)
    assert mean_power(cutting_record(cut, SHARP)) == pytest.approx(expected, rel=SPREAD)


def test_slotting_forces_are_altintas_closed_form():
    """Mean of a straight or helical slot: F_x = -Z a (K_rc c/4 + K_re/π), F_y with K_t, F_z -K_ac c/π."""
    cut = CUTS["flat slot"]
    teeth, depth, bite = cut.mill.teeth, cut.depth, cut.feed_per_tooth
    expected = (
        teeth
        * depth
        * np.array(
            [
                -(STEEL.radial * bite / 4.0 + STEEL.radial_edge / np.pi),
                STEEL.tangential * bite / 4.0 + STEEL.tangential_edge / np.pi,
                -(STEEL.axial * bite / np.pi + STEEL.axial_edge / 2.0),
            ]
        )
    )
    record = cutting_record(cut, STEEL)
    np.testing.assert_allclose(mean_force(record), expected, rtol=1e-4)
    # Mean tangential force of one tooth over its half turn is torque over radius: K_tc c/π + K_te/2 per mm.
    tangential = teeth * depth * (STEEL.tangential * bite / np.pi + STEEL.tangential_edge / 2.0)
    assert mean_torque(record) / cut.mill.radius == pytest.approx(tangential, rel=1e-6)


def test_an_upright_ball_slot_is_quadrature_over_its_profile():
    """dF over κ and φ by the textbook's own projection, written out again."""
    mill = EndMill("ball", 10.0, teeth=1)
    cut = Cut(mill, 2.0, 10.0, 5.0, 500.0)
    k, radius, bite = STEEL, 5.0, cut.feed_per_tooth

    def slice_force(kappa, axis):
        # Means over φ in (0, π) of sin², cos², sin and 1, per turn; those of cos and sin·cos vanish.
        half, quarter, lone = 1.0 / np.pi, 1.0 / 4.0, 1.0 / 2.0
        chip = bite * np.sin(kappa)
        t, te = k.tangential * chip, k.tangential_edge
        r, re = k.radial * chip, k.radial_edge
        a, ae = k.axial * chip, k.axial_edge
        x = -(r * quarter + re * half) * np.sin(kappa) - (a * quarter + ae * half) * np.cos(kappa)
        y = t * quarter + te * half
        z = (r * half + re * lone) * np.cos(kappa) - (a * half + ae * lone) * np.sin(kappa)
        return radius * (x, y, z)[axis]

    cap = np.arccos(1.0 - cut.depth / radius)
    expected = [quad(slice_force, 0.0, cap, args=(axis,))[0] for axis in range(3)]
    record = cutting_record(cut, STEEL, samples=7200)
    np.testing.assert_allclose(mean_force(record), expected, rtol=STRAIGHT / 10.0)


def test_lead_and_lean_are_those_of_the_posture_baselines():
    """In feed axes: feed x, normal z; both rooms must mean the same by the two angles."""
    cut = CUTS["ball tilted"]
    normal, feed = np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(cut.tool_axes[2], leaned(normal, feed, cut.lead, cut.lean)[0], atol=1e-15)
    np.testing.assert_allclose(cut.tool_axes @ cut.tool_axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(cut.tool_axes) == pytest.approx(1.0)


@pytest.mark.parametrize("shape", ["flat", "ball"])
def test_up_milling_works_on_the_left_of_the_feed_and_down_milling_on_its_right(shape):
    """A clockwise tooth is on the left until 90 deg; the centre of its work lies as far on either side."""
    mill, centre = EndMill(shape, 10.0, teeth=1), {}
    for milling in ("up", "down"):
        record = cutting_record(Cut(mill, 1.0, 1.0, 5.0, 500.0, milling), SHARP)
        centre[milling] = np.sum(record.angle * record.power) / np.sum(record.power) / DEGREE
    assert centre["up"] < 60.0
    assert centre["up"] + centre["down"] == pytest.approx(180.0, abs=0.5)


@pytest.mark.parametrize("name", ["flat up", "ball slot", "ball tilted"])
@pytest.mark.parametrize("missing", ["depth", "width"])
def test_no_depth_or_no_width_cuts_nothing(name, missing):
    cut = replace(CUTS[name], **{missing: 0.0})
    record = cutting_record(cut, STEEL)
    assert mean_cutting_power(cut, STEEL) == 0.0
    assert not record.force.any()
    assert not record.power.any()


@pytest.mark.parametrize("width", [0.3, 3.0, 6.0, 7.9, 8.0, 8.1, 10.0])
def test_a_balls_section_and_swept_surface_are_quadratures_over_height(width):
    cut = Cut(EndMill("ball", 10.0), 2.0, width, 20.0, 500.0)
    radius = 5.0

    def chord(height):
        return np.sqrt(radius**2 - (radius - height) ** 2)

    def arc(height):
        # Archimedes: a zone of the sphere has the area of its cylinder, R dz by angle.
        return radius * (np.pi / 2.0 + np.arcsin(min(1.0, width / chord(height) - 1.0)))

    meeting = radius - np.sqrt(radius**2 - width**2 / 4.0)
    kink = [meeting] if 0.0 < meeting < 2.0 else None
    section = quad(lambda z: min(2.0 * chord(z), width), 0.0, 2.0, points=kink, limit=200)[0]
    surface = quad(arc, 0.0, 2.0, points=kink, limit=200)[0]
    assert removal_rate(cut) == pytest.approx(20.0 * section, rel=1e-7)
    assert swept_surface(cut) == pytest.approx(surface, rel=1e-7)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"depth": -1.0}, SettingError, "depth of cut is -1 mm; give 0 mm or more"),
        ({"depth": 5.5}, SettingError, "depth of cut is 5.5 mm, above 5 mm; a ball cuts one radius"),
        ({"width": 11.0}, SettingError, "width of cut is 11 mm, above 10 mm; a full slot"),
        ({"width": np.nan}, SettingError, "width of cut is nan mm; it must be a finite number"),
        ({"feed": 0.0}, SettingError, "feed is 0 mm/s; give a number above 0"),
        ({"spindle": -5.0}, SettingError, "spindle speed is -5 rad/s"),
        ({"feed": 1200.0, "spindle": 100.0}, SettingError, "feed per tooth is 37.6991 mm, above 5 mm; check"),
        ({"milling": "climb"}, SettingError, "milling is 'climb'; take up or down"),
        ({"lead": np.pi / 2.0}, SettingError, "lead is 90 deg; it must lie between"),
        ({"lean": -2.0}, SettingError, "lean is -114.592 deg"),
        ({"lead": 0.8}, ToolError, r"8.9\d* deg above the ball's equator.*lean less"),
        ({"mill": FLAT, "lean": 0.1}, SettingError, "flat end mill has lead 0 and lean 5.7.* only a ball"),
    ],
)
def test_an_impossible_cut_is_refused_with_its_bound(change, error, message):
    with pytest.raises(error, match=message):
        replace(Cut(BALL, 2.0, 10.0, 20.0, 500.0), **change)


def test_a_ball_may_lean_further_to_the_free_side_than_to_the_material():
    """Down milling has its material on the right: leaning right lifts it over the equator."""
    cut = Cut(BALL, 2.0, 1.0, 20.0, 500.0, "down")
    left = replace(cut, lean=-50.0 * DEGREE)
    assert mean_power(cutting_record(left, STEEL)) == pytest.approx(
        mean_cutting_power(cut, STEEL), rel=SPREAD
    )
    with pytest.raises(ToolError, match="lean back or to the free side"):
        replace(cut, lean=60.0 * DEGREE)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"shape": "bull"}, "end mill shape is 'bull'; take flat or ball"),
        ({"diameter": 0.0}, "tool diameter is 0 mm; give a number above 0"),
        ({"teeth": 0}, "number of teeth is 0; give a whole number"),
        ({"teeth": 2.5}, "number of teeth is 2.5"),
        ({"helix": 30.0}, "helix angle is 1718.87 deg; it must lie between"),
    ],
)
def test_an_impossible_mill_is_refused(arguments, message):
    with pytest.raises(ToolError, match=message):
        EndMill(**{"shape": "flat", "diameter": 10.0} | arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tangential": 0.0}, "tangential cutting coefficient is 0 N/mm²; give a number above 0"),
        ({"radial": -1.0}, "radial cutting coefficient is -1 N/mm²"),
        ({"tangential_edge": -1.0}, "tangential edge coefficient is -1 N/mm; give 0"),
        ({"radial_edge": -1.0}, "radial edge coefficient"),
        ({"axial": np.inf}, "axial cutting coefficient is inf"),
        ({"axial_edge": np.nan}, "axial edge coefficient is nan"),
    ],
)
def test_impossible_coefficients_are_refused(arguments, message):
    with pytest.raises(SettingError, match=message):
        ForceCoefficients(**{"tangential": 1800.0} | arguments)
