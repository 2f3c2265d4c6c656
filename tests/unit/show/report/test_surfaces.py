"""The power surface that is looked at: its numbers by the power model, its postures, its files."""

from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from support.browser import CHROMIUM

import fiveaxis as fx
from fiveaxis.base.errors import SettingError
from fiveaxis.model import (
    Constraints,
    follow,
    linear_positions,
    motion_energy,
    rotary_angles,
    tool_axes,
    travel_costs,
)
from fiveaxis.posture import Baseline, Optimum

FEED = 1000.0  # mm/min
TIP = (30.0, 10.0, 20.0)  # mm
NAME = "<b>ring $5$.csv"


@pytest.fixture(scope="module")
def solution(hayashi) -> Optimum:
    """A ring on the underside of a dome with the tool at 30 degrees from the normal, compared with 60."""
    turn = np.linspace(0.0, 1.5 * np.pi, 60)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(60, -0.3)])
    path = fx.Toolpath.from_contacts(25.0 * normal, normal, fx.Tool.ball(8), feed_mm_min=FEED, name=NAME)

    def tilted(degrees: float) -> Baseline:
        up = np.array([0.0, 0.0, 1.0]) - path.normal[:, 2:] * path.normal
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        axis = np.cos(np.radians(degrees)) * path.normal + np.sin(np.radians(degrees)) * up
        motion = follow(path, hayashi, np.unwrap(rotary_angles(hayashi, axis)[1], axis=0))
        return Baseline(motion, motion_energy(hayashi, motion))

    result = tilted(30.0)
    bounds = Constraints.of_degrees(tilt=(15, 75)).lean_bounds(path)
    return Optimum(
        machine=hayashi,
        toolpath=path,
        tilt=bounds,
        motion=result.motion,
        energy=result.energy,
        compared={"normal": tilted(60.0)},
        missing={},
        stages=(),
    )


def height(machine, positions) -> float:
    """Energy of the move from the axes' zero to positions, (k,), from the prices of the axes."""
    plus, minus = (side[0] for side in travel_costs(machine, np.array([FEED / 60.0])))
    return float(plus @ np.maximum(positions, 0.0) + minus @ np.maximum(-positions, 0.0))


def test_the_cheapest_posture_of_a_tip_is_where_the_power_model_has_its_minimum(hayashi):
    surface = fx.tip_surface(hayashi, TIP, FEED, normal=(0, 0, 1), tilt=(15, 75), step_deg=5.0)
    best, cheapest = np.inf, None
    for first in surface.power.first:
        for second in surface.power.second:
            rotary = np.array([[first, second]])
            lean = np.degrees(np.arccos(tool_axes(hayashi, rotary)[0, 2]))
            if 15.0 - 1e-9 <= lean <= 75.0 + 1e-9:
                found = height(hayashi, linear_positions(hayashi, np.array([TIP]), rotary)[0])
                best, cheapest = min((best, cheapest), (found, (first, second)), key=lambda pair: pair[0])
    np.testing.assert_allclose(surface.postures["cheapest"][0], cheapest)
    assert surface.power.total[surface.admissible].min() == pytest.approx(best, rel=1e-12)


def test_the_rotary_part_is_least_at_home_and_the_parts_add_up(hayashi):
    power = fx.tip_surface(hayashi, TIP, FEED, step_deg=5.0).power
    row, column = np.unravel_index(power.rotary.argmin(), power.rotary.shape)
    assert power.first[row] == pytest.approx(0.0, abs=1e-9)
    assert power.second[column] == pytest.approx(0.0, abs=1e-9)
    assert power.rotary.min() == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(power.total, power.linear + power.rotary)
    x, y, z = linear_positions(hayashi, np.array([TIP]), np.zeros((1, 2)))[0, :3]
    at_home = height(hayashi, np.array([x, y, z, 0.0, 0.0]))
    assert power.linear[row, column] == pytest.approx(at_home, rel=1e-9)


def test_a_tip_without_bounds_is_limited_by_the_axes_alone(hayashi):
    free = fx.tip_surface(hayashi, TIP, FEED, step_deg=10.0)
    assert free.admissible.all()
    assert "admissible" not in free.columns()
    with pytest.raises(SettingError, match="tilt needs normal too"):
        fx.tip_surface(hayashi, TIP, FEED, tilt=(15, 75))
    with pytest.raises(SettingError, match=r"^tip is missing; give"):
        fx.tip_surface(hayashi)
    with pytest.raises(SettingError, match="the normal has length 0"):
        fx.tip_surface(hayashi, TIP, FEED, normal=(0, 0, 0), tilt=(15, 75))
    with pytest.raises(SettingError, match="the tip must be three finite numbers"):
        fx.tip_surface(hayashi, (1.0, np.nan, 2.0), FEED)
    with pytest.raises(SettingError, match="step is 0 deg; it must be between"):
        fx.tip_surface(hayashi, TIP, FEED, step_deg=0.0)


def test_at_a_location_the_contact_is_held_and_the_programs_are_marked(solution):
    at = 20
    surface, machine = fx.location_surface(solution, at), solution.machine
    for name, motion in (("optimised", solution.motion), ("normal", solution.compared["normal"].motion)):
        chosen, *others = surface.postures[name]
        rotary = motion.positions[at, machine.rotary_columns]
        np.testing.assert_allclose(np.cos(chosen), np.cos(rotary), atol=1e-12)
        for other in others:
            assert np.abs(np.sin((other - chosen) / 2.0)).max() > 0.1
            np.testing.assert_allclose(
                tool_axes(machine, other[None]), tool_axes(machine, chosen[None]), atol=1e-9
            )


def test_the_other_branch_is_shown_where_the_axes_reach_it(solution):
    # A goes to 30 degrees only, and on the underside the tool leans farther than that.
    reached = [len(fx.location_surface(solution, at).postures["optimised"]) for at in range(0, 60, 10)]
    unlimited = replace(solution, machine=fx.Machine.from_code("640123").with_drives_of(solution.machine))
    assert set(reached) == {1}
    assert len(fx.location_surface(unlimited, 20).postures["optimised"]) == 2


def test_the_floor_of_the_valley_is_the_cheapest_admissible_posture(solution):
    valley = fx.path_valley(solution)
    np.testing.assert_array_equal(valley.locations, np.arange(60))
    surface = fx.location_surface(solution, 30)
    least = surface.power.total[surface.admissible].min()
    # The grids differ: 3 by 2 degrees along the path, 1.5 at one location.
    assert np.nanmin(valley.cost[30]) == pytest.approx(least, rel=0.05)
    assert valley.position[-1] == pytest.approx(float(solution.toolpath.lengths.sum()))


def test_what_the_moves_cost_along_the_valley_is_the_programs_energy(solution):
    valley = fx.path_valley(solution)
    rates, lengths = valley.rates(), np.diff(valley.position)
    motions = {"optimised": solution.motion} | {n: b.motion for n, b in solution.compared.items()}
    for name, spent in valley.spent.items():
        expected = motion_energy(solution.machine, motions[name]).total
        assert spent[-1] == pytest.approx(expected)
        assert np.isnan(rates[name][0])
        assert np.nansum(rates[name][1:] * lengths) == pytest.approx(expected)
    assert min(valley.spent, key=lambda name: valley.spent[name][-1]) == "optimised"


def test_the_programs_lie_in_the_valley_at_their_own_height(solution):
    valley, machine = fx.path_valley(solution), solution.machine
    for name, motion in (("optimised", solution.motion), ("normal", solution.compared["normal"].motion)):
        angles = motion.positions[:, machine.column(valley.letter)]
        np.testing.assert_allclose(np.cos(valley.postures[name]), np.cos(angles), atol=1e-12)
        for at in (0, 30, 59):
            shown = motion.positions[at].copy()
            shown[machine.column("C")] = valley.postures[name][at]
            assert valley.heights[name][at] == pytest.approx(height(machine, shown))
        floor = np.nanmin(valley.cost, axis=1)
        # The floor is that of a grid of some degrees.
        assert np.all(valley.heights[name] > 0.98 * floor)


def test_baselines_with_locations_of_their_own_are_named_and_not_drawn(solution):
    own = replace(solution.compared["normal"], toolpath=solution.toolpath)
    valley = fx.path_valley(replace(solution, compared={"normal": own}))
    assert valley.elsewhere == ("normal",)
    assert set(valley.postures) == {"optimised"}


@pytest.mark.parametrize("location", [-1, 60])
def test_a_location_that_the_path_hasnt_is_refused(solution, location):
    with pytest.raises(SettingError, match=f"location is {location}; it must be between 0 and 59"):
        fx.location_surface(solution, location)


@pytest.fixture(scope="module", params=["location", "valley"])
def drawn(request, solution):
    if request.param == "valley":
        return fx.path_valley(solution)
    return fx.location_surface(solution, 20, step_deg=4.0)


def texts_of(page: str) -> str:
    """Give the text of a page, in which a reader finds no script and no link to elsewhere."""

    class Reader(HTMLParser):
        found = ""

        def handle_starttag(self, tag, attrs):
            assert tag not in ("script", "b", "iframe", "link", "object")
            assert not any((value or "").startswith(("http:", "https:", "//")) for _, value in attrs)

        def handle_data(self, data):
            self.found += data

    reader = Reader()
    reader.feed(page)
    return reader.found


def test_every_format_is_valid_and_shows_the_programs(drawn, tmp_path):
    svg = ElementTree.parse(drawn.write(tmp_path / "drawn.svg")).getroot()
    assert svg.tag == "{http://www.w3.org/2000/svg}svg"
    words = "".join(svg.itertext())
    page = drawn.write(tmp_path / "drawn.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    for text in ("optimised", "normal", NAME, "C (deg)", "S_W"):
        assert text in words
        assert text in texts_of(page)
    assert ElementTree.fromstring(drawn._repr_svg_()).tag == svg.tag


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium on the path")
def test_the_page_of_a_drawing_is_seen_in_a_browser_without_a_complaint(browser, drawn, tmp_path):
    browser.open(drawn.write(tmp_path / "drawn.html").as_uri())
    assert browser.complaints == []
    assert browser.run("document.querySelector('svg').getBoundingClientRect().width") > 800
    assert browser.run("document.querySelectorAll('svg image').length") >= 1
    assert browser.shoot(tmp_path / "seen.png").std() > 0.1


def test_what_has_nothing_to_show_is_drawn_too(solution, tmp_path):
    nowhere = fx.tip_surface(solution.machine, TIP, FEED, normal=(1, 0, 0), tilt=(0, 1), step_deg=40.0)
    assert not nowhere.admissible.any()
    assert nowhere.postures == {}
    assert nowhere.write(tmp_path / "nowhere.svg").stat().st_size > 1000
    reference = np.full_like(solution.tilt.reference, np.nan)
    free = replace(solution, tilt=replace(solution.tilt, reference=reference, beside=()))
    assert fx.location_surface(free, 3, step_deg=20.0).write(tmp_path / "free.svg").stat().st_size > 1000
    one = np.array([0])
    motion = solution.motion.at(one)
    alone = replace(
        solution, toolpath=solution.toolpath.at(one), tilt=solution.tilt.at(one), motion=motion, compared={}
    )
    assert fx.path_valley(alone).write(tmp_path / "alone.svg").stat().st_size > 1000


def test_the_table_has_the_numbers_of_the_surface(drawn, tmp_path):
    header, *rows = drawn.write(tmp_path / "drawn.CSV").read_text(encoding="utf-8").splitlines()
    columns = drawn.columns()
    assert header.split(",") == list(columns)
    assert len(rows) == len(columns["S_W_J"])
    for column, values in enumerate(columns.values()):
        written = [float(row.split(",")[column] or "nan") for row in rows]
        np.testing.assert_allclose(written, values, rtol=0.0, atol=1e-6)


def test_another_suffix_is_refused_before_anything_is_written(drawn, tmp_path):
    target: Path = tmp_path / "drawn.pdf"
    with pytest.raises(SettingError, match=r"drawn.pdf: .*let it end in \.csv, \.svg or \.html"):
        drawn.write(target)
    assert not target.exists()
