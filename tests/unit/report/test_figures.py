from __future__ import annotations

import base64
import io
import re
import struct
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from fiveaxis.energy import move_powers
from fiveaxis.posture import Solution
from fiveaxis.report.chart import FORBIDDEN
from fiveaxis.report.figures import (
    axis_lines,
    drive_powers,
    energy_bars,
    mean_speeds,
    power_lines,
    speed_lines,
    spending_lines,
    tilts_shown,
)
from fiveaxis.report.landscape import posture_map, surface_at
from fiveaxis.report.maps import posture_map_figure, surface_figure
from fiveaxis.toolpath import TiltBounds


def words(svg: str) -> list[str]:
    """Return the pieces of text in a figure."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg)


def pictures(svg: str) -> list[bytes]:
    """Return the PNGs inlined in a figure: the map, and its colour bar."""
    addresses = re.findall(r'href="data:image/png;base64,([^"]*)"', svg)
    return [base64.b64decode(address, validate=True) for address in addresses]


def chunks(data: bytes) -> Iterator[bytes]:
    """Return the kinds of the chunks of a PNG."""
    at = 8
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        yield data[at + 4 : at + 8]
        at += length + 12


def test_every_bar_is_labelled_with_the_energy_of_its_axis(solution: Solution) -> None:
    text = words(energy_bars(solution, "normal"))
    for energy in (solution.energy, solution.baselines["normal"]):
        for joules in energy.by_axis.values():
            assert f"{joules:,.0f}".replace(",", "\u2009") in text
    assert {"X", "Y", "Z", "A", "C", "energy (J)", "machine axis", "normal", "optimised"} <= set(text)


def test_every_axis_has_its_unit_and_both_lines_a_name(solution: Solution) -> None:
    text = words(axis_lines(solution, "normal"))
    assert {"X (mm)", "Y (mm)", "Z (mm)", "A (deg)", "C (deg)", "tilt (deg)"} <= set(text)
    assert {"normal", "optimised", "location along the path (row, from 0)"} <= set(text)


def test_the_energy_along_the_path_has_its_unit(solution: Solution) -> None:
    assert {"energy so far (J)", "normal", "optimised"} <= set(words(spending_lines(solution, "normal")))


@pytest.mark.parametrize("draw", [energy_bars, axis_lines, spending_lines])
def test_without_a_baseline_the_result_is_drawn_alone(solution: Solution, draw: object) -> None:
    text = words(draw(replace(solution, compared={}), None))  # type: ignore[operator]
    assert "optimised" in text
    assert "normal" not in text


@pytest.mark.parametrize("draw", [energy_bars, axis_lines, spending_lines])
def test_a_chart_carries_no_date_and_no_link(solution: Solution, draw: object) -> None:
    svg = draw(solution, "normal")  # type: ignore[operator]
    assert "http" not in svg
    assert "metadata" not in svg
    assert re.search(r"\b20\d\d-\d\d", svg) is None


def test_the_tilt_drawn_is_the_tilt_that_was_chosen(solution: Solution) -> None:
    np.testing.assert_allclose(tilts_shown(solution, solution.motion), 15.0, atol=1e-9)
    np.testing.assert_allclose(tilts_shown(solution, solution.compared["normal"].motion), 45.0, atol=1e-9)


def test_a_path_with_links_is_drawn(solution: Solution) -> None:
    reference = solution.tilt.reference.copy()
    reference[100:120] = np.nan
    bounds = TiltBounds(reference, solution.tilt.low, solution.tilt.high, "normal")
    linked = replace(solution, tilt=bounds)
    assert np.isnan(tilts_shown(linked, linked.motion)).sum() == 20
    assert "tilt (deg)" in words(axis_lines(linked, "normal"))


def test_maps_are_pictures_without_date_or_program(solution: Solution) -> None:
    for svg in (
        posture_map_figure(solution, posture_map(solution), "normal"),
        surface_figure(solution, surface_at(solution, 180), "normal"),
    ):
        found = pictures(svg)
        assert len(found) == 2
        assert all(list(chunks(data)) == [b"IHDR", b"IDAT", b"IEND"] for data in found)


def grey_pixels(svg: str) -> int:
    """Count the pixels of a map in the colour of what is forbidden."""
    picture = imread(io.BytesIO(pictures(svg)[0]))
    forbidden = np.array([int(FORBIDDEN[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return int(np.all(np.abs(picture[..., :3] - forbidden) < 1e-3, axis=-1).sum())


def test_where_no_second_angle_is_admissible_the_map_is_grey(solution: Solution) -> None:
    free = replace(solution, tilt=TiltBounds(solution.tilt.reference, 0.0, np.pi, "normal"))
    assert grey_pixels(posture_map_figure(solution, posture_map(solution), "normal")) > 50_000
    assert grey_pixels(posture_map_figure(free, posture_map(free), "normal")) < 500


def test_a_posture_outside_the_axis_limits_widens_the_surface(trunnion_solution: Solution) -> None:
    surface = surface_at(trunnion_solution, 180)
    home = replace(trunnion_solution.motion, positions=np.zeros_like(trunnion_solution.motion.positions))

    def share_of_map(svg: str) -> float:
        """Return how much of the panel's height the map takes; the rest is grey."""
        image = re.search(r'<image [^>]*height="([\d.]+)"', svg)
        ground = re.search(r'<rect [^>]*height="([\d.]+)"', svg)
        return float(image[1]) / float(ground[1])  # type: ignore[index]

    assert share_of_map(surface_figure(trunnion_solution, surface, None)) < 0.95
    inside = surface_figure(replace(trunnion_solution, motion=home), surface, None)
    assert share_of_map(inside) == pytest.approx(1.0)


def test_what_collides_is_hatched(solution: Solution) -> None:
    landscape = posture_map(solution)
    half = np.arange(len(landscape.first)) % 40 < 20
    hidden = replace(
        landscape,
        cost=np.where(half, np.nan, landscape.cost),
        colliding=np.isfinite(landscape.cost) & half,
    )
    plain = replace(hidden, colliding=np.zeros_like(hidden.colliding))
    hatched = grey_pixels(posture_map_figure(solution, hidden, "normal"))
    assert hatched < grey_pixels(posture_map_figure(solution, plain, "normal")) - 1000


def test_speeds_of_every_axis_have_their_unit_over_time(solution: Solution) -> None:
    units = {"X (mm/min)", "Y (mm/min)", "Z (mm/min)", "A (deg/min)", "C (deg/min)", "time (s)"}
    assert units | {"normal", "optimised"} <= set(words(speed_lines(solution, "normal")))


def test_powers_of_every_drive_and_of_all_have_their_unit_over_time(solution: Solution) -> None:
    units = {"X (W)", "Y (W)", "Z (W)", "A (W)", "C (W)", "all (W)", "time (s)"}
    assert units | {"normal", "optimised"} <= set(words(power_lines(solution, "normal")))


@pytest.mark.parametrize("draw", [speed_lines, power_lines])
def test_without_a_baseline_the_result_alone_is_drawn_over_time(solution: Solution, draw: object) -> None:
    text = words(draw(replace(solution, compared={}), None))  # type: ignore[operator]
    assert "optimised" in text
    assert "normal" not in text


def test_speed_times_time_is_the_travel_of_the_axis(solution: Solution) -> None:
    motion = solution.motion
    np.testing.assert_allclose(mean_speeds(motion) * motion.time[:, None], motion.moves, atol=1e-9)


def test_the_area_under_the_last_band_is_the_power_integral(solution: Solution) -> None:
    powers = drive_powers(solution, "optimised")
    assert float(powers[-1] @ solution.motion.time) == pytest.approx(solution.energy.total)
    np.testing.assert_allclose(powers[-1], move_powers(solution.machine, solution.motion).sum(axis=1))


@pytest.mark.parametrize(("share", "dotted"), [(1.2, True), (30.0, False)])
def test_a_highest_speed_is_dotted_only_where_the_motion_comes_near_it(
    solution: Solution, share: float, dotted: bool
) -> None:
    top = np.abs(mean_speeds(solution.motion)).max(axis=0)
    axes = tuple(
        replace(a, max_speed=share * float(v)) for a, v in zip(solution.machine.axes, top, strict=True)
    )
    quick = replace(solution, machine=replace(solution.machine, axes=axes), compared={})
    assert ("#555555" in speed_lines(quick, None)) is dotted
