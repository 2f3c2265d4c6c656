"""Maps of postures: pictures, what they leave grey and what they hatch."""

import base64
import io
import re
import struct
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from fiveaxis.model import TiltBounds
from fiveaxis.posture import Optimum
from fiveaxis.show import location_surface, path_valley
from fiveaxis.show.report.chart import FORBIDDEN
from fiveaxis.show.report.maps import draw_location, png_address


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


def test_a_picture_is_read_back_as_it_was() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    data = base64.b64decode(png_address(picture).removeprefix("data:image/png;base64,"))
    read = imread(io.BytesIO(data))
    np.testing.assert_array_equal(np.round(255.0 * read[..., :3]).astype(np.uint8), picture)


def test_maps_are_pictures_without_date_or_program(solution: Optimum) -> None:
    for shown, count in ((path_valley(solution), 2), (location_surface(solution, 180), 6)):
        found = pictures(shown.figure())
        assert len(found) == count
        assert all(list(chunks(data)) == [b"IHDR", b"IDAT", b"IEND"] for data in found)


def grey_pixels(svg: str) -> int:
    """Count the pixels of a map in the colour of what is forbidden."""
    picture = imread(io.BytesIO(pictures(svg)[0]))
    forbidden = np.array([int(FORBIDDEN[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return int(np.all(np.abs(picture[..., :3] - forbidden) < 1e-3, axis=-1).sum())


def test_where_no_second_angle_is_admissible_the_map_is_grey(solution: Optimum) -> None:
    free = replace(solution, tilt=TiltBounds(solution.tilt.reference, 0.0, np.pi, "normal"))
    assert grey_pixels(path_valley(solution).figure()) > 50_000
    assert grey_pixels(path_valley(free).figure()) < 500


def test_a_posture_outside_the_axis_limits_widens_the_surface(trunnion_solution: Optimum) -> None:
    home = replace(trunnion_solution.motion, positions=np.zeros_like(trunnion_solution.motion.positions))

    def share_of_map(solution: Optimum) -> float:
        """Return how much of the panel's height the map takes; the rest is grey."""
        surface = location_surface(solution, 180)
        svg = draw_location(surface, {"S_W": surface.power.total})
        image = re.search(r'<image [^>]*height="([\d.]+)"', svg)
        ground = re.search(r'<rect [^>]*height="([\d.]+)"', svg)
        return float(image[1]) / float(ground[1])  # type: ignore[index]

    alone = replace(trunnion_solution, compared={})
    assert share_of_map(alone) < 0.95
    assert share_of_map(replace(alone, motion=home)) == pytest.approx(1.0)


def test_what_collides_is_hatched(solution: Optimum) -> None:
    valley = path_valley(solution)
    half = np.arange(len(valley.first)) % 40 < 20
    hidden = replace(
        valley, cost=np.where(half, np.nan, valley.cost), colliding=np.isfinite(valley.cost) & half
    )
    plain = replace(hidden, colliding=np.zeros_like(hidden.colliding))
    assert grey_pixels(hidden.figure()) < grey_pixels(plain.figure()) - 1000
