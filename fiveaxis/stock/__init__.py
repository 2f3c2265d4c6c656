"""The stock as it is cut: rays of material, what a cutter sweeps of them, and the result beside the part."""

from fiveaxis.stock.comparing import Deviations, compare, require_part_inside, sweep_tolerance
from fiveaxis.stock.cutting import Blank, CutStock, cut_stock
from fiveaxis.stock.dexels import UNCUT, Removal, Stock, default_resolution
from fiveaxis.stock.display import mesh_of
from fiveaxis.stock.sources import fill, load_stock, names_file, names_mesh, read_stock, save_stock
from fiveaxis.stock.sweeping import Poses, Sweep, swept

__all__ = [
    "UNCUT",
    "Blank",
    "CutStock",
    "Deviations",
    "Poses",
    "Removal",
    "Stock",
    "Sweep",
    "compare",
    "cut_stock",
    "default_resolution",
    "fill",
    "load_stock",
    "mesh_of",
    "names_file",
    "names_mesh",
    "read_stock",
    "require_part_inside",
    "save_stock",
    "sweep_tolerance",
    "swept",
]
