"""The stock as it is shown: each step is the stock as it is then, and steps only remove."""

import numpy as np
import pytest
import trimesh

from fiveaxis.check import Blank
from fiveaxis.check.stock.colouring import FINISHED, GOUGED, LEFT, UNCUT, colours_at
from fiveaxis.check.stock.comparing import sweep_tolerance
from fiveaxis.check.stock.cutting import cut_stock
from fiveaxis.check.stock.dexels import Stock
from fiveaxis.check.stock.display import STAYS, mesh_of, play
from fiveaxis.check.stock.sources import box, load_stock
from fiveaxis.check.stock.sweeping import Poses, cutter_bodies, swept
from fiveaxis.model import Tool
from fiveaxis.model.toolpath import shapes

PITCH = 0.2
SIZE = (24.0, 14.0, 8.0)
# Share of a volume by which the rounded edges of surface nets change it.
ROUNDED = 0.005
TOOLS = {"ball": Tool.ball(6.0), "flat": Tool(shapes.flat(6.0, length=25.0))}
# To and fro, deeper each time, leaning; the last move is in the air.
TIPS = np.array(
    [(2, 4, 7), (22, 4, 7), (22, 8, 6), (2, 8, 6), (2, 10, 5), (12, 10, 4), (12, 10, 50), (2, 10, 60)], float
)
AXES = np.array([(0.2 * (-1) ** i, 0.1 * i - 0.2, 1.0) for i in range(len(TIPS))])


def poses(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tips and axes move in proportion between rows."""
    every = np.arange(len(TIPS))
    tip, axis = (np.stack([np.interp(place, every, c) for c in a.T], axis=1) for a in (TIPS, AXES))
    return tip, axis / np.linalg.norm(axis, axis=1, keepdims=True)


def block() -> Stock:
    return box(np.array([(0.0, 0.0, 0.0), SIZE]), PITCH)


def cut_to(place: float, tool: Tool, move: Poses = poses) -> Stock:
    """Return the block after a fractional row, cut at once and by all of its rays."""
    stock, rows = block(), int(np.ceil(place))
    swept_in = swept(
        cutter_bodies(tool),
        lambda at: move(at * place / rows),
        np.arange(1, rows + 1),
        0.1 * PITCH,
        np.array([stock.low, stock.high]),
    )
    stock.cut(*swept_in, blocks=rows + 1)
    return stock


@pytest.mark.parametrize("name", TOOLS)
def test_each_step_is_the_stock_as_it_is_then(name):
    ends = np.linspace(0.0, len(TIPS) - 1.0, 41)[1:]
    found = play(block(), TOOLS[name], poses, len(TIPS), ends)
    whole = np.prod(SIZE)
    assert found.mesh(0).volume == pytest.approx(whole, rel=ROUNDED)
    for step in (7, 20, 33, 40):
        wanted = cut_to(ends[step - 1], TOOLS[name]).volumes().mean()
        # Beside what is rounded at the start, what was removed is exact to its own rounded edges.
        assert found.mesh(step).volume == pytest.approx(wanted, abs=ROUNDED * whole)
    removed = found.mesh(0).volume - found.mesh(40).volume
    assert removed == pytest.approx(whole - wanted, rel=0.01)


@pytest.mark.parametrize("name", TOOLS)
def test_steps_only_remove_and_a_move_in_the_air_changes_nothing(name):
    found = play(block(), TOOLS[name], poses, len(TIPS), np.linspace(0.0, len(TIPS) - 1.0, 71)[1:])
    volumes = np.array([found.mesh(step).volume for step in range(71)])
    assert (np.diff(volumes) <= 1e-3).all()
    assert volumes[60] == volumes[70] < volumes[40]
    born, gone = found.lives.T
    assert (np.diff(born) >= 0).all()
    assert (born < gone).all()
    # A vertex that is there before and after keeps its number: what isn't cut isn't sent again.
    untouched = (born == 0) & (gone == STAYS)
    assert untouched.sum() > 0.2 * len(found.at(0))


def test_the_last_step_is_the_mesh_of_what_is_left():
    found = play(block(), TOOLS["ball"], poses, len(TIPS), np.linspace(0.0, len(TIPS) - 1.0, 31)[1:])
    stock = block()
    bounds = np.array([stock.low, stock.high])
    stock.cut(
        *swept(cutter_bodies(TOOLS["ball"]), poses, np.arange(1, len(TIPS)), sweep_tolerance(PITCH), bounds),
        blocks=len(TIPS),
    )
    left, shown = mesh_of(stock), found.mesh(30)
    assert len(shown.faces) == pytest.approx(len(left.faces), rel=1e-3)
    assert shown.volume == pytest.approx(left.volume, rel=1e-3)


def test_every_few_rays_of_a_stock_have_its_material():
    stock = cut_to(3.0, TOOLS["ball"])
    for stride in (2, 3, 7):
        few = stock.thinned(stride)
        assert few.pitch == pytest.approx(stride * stock.pitch)
        assert few.surface().points.min(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)
        assert few.surface().points.max(axis=0) == pytest.approx(SIZE, abs=1e-5)
        assert set(np.round(few.surface().points, 3).ravel()) <= set(
            np.round(stock.surface().points, 3).ravel()
        )


@pytest.mark.parametrize("tolerance", [0.05, 0.3])
def test_places_have_the_colour_of_what_is_left_or_gouged(tolerance):
    mesh = trimesh.creation.box(bounds=[(0.0, 0.0, 0.0), (24.0, 14.0, 6.0)])
    blank = Blank.of(load_stock("box:24:14:8", mesh, PITCH), mesh)
    # A slot 0.2 mm too deep, one 1 mm too high, one at the height of the part.
    rows = [
        (-9, 3, 5.8),
        (33, 3, 5.8),
        (33, 3, 20),
        (-9, 8, 7),
        (33, 8, 7),
        (33, 8, 20),
        (-9, 12, 6),
        (33, 12, 6),
    ]
    tips, every = np.array(rows), np.arange(len(rows))

    def upright(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.stack([np.interp(place, every, c) for c in tips.T], axis=1), np.tile(
            [0.0, 0.0, 1.0], (len(place), 1)
        )

    cut = cut_stock(blank, Tool(shapes.flat(3.0, length=25.0)), upright, every[1:], len(rows))
    at = np.array(
        [(12.0, 3.0, 5.8), (12.0, 8.0, 7.0), (12.0, 12.0, 6.0), (12.0, 5.4, 8.0), (12.0, 5.4, 40.0)]
    )
    found = colours_at(at, cut.deviations, tolerance, 2.0 * PITCH)
    gouged = GOUGED if tolerance < 0.1 else FINISHED
    assert [tuple(c) for c in found[[0, 2, 3, 4]].tolist()] == [gouged, FINISHED, UNCUT, UNCUT]
    # Wholly blue from ten tolerances on.
    blue = (
        (np.array(LEFT) - FINISHED)
        @ (found[1] - np.array(FINISHED))
        / np.sum((np.array(LEFT) - FINISHED) ** 2)
    )
    assert blue == pytest.approx(1.0 if tolerance < 0.1 else 0.25 + 0.75 * 0.7 / 2.7, abs=0.02)
