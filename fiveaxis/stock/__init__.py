"""The stock as it is cut: rays of material, what a cutter sweeps of them, and the result beside the part."""

from fiveaxis.stock.comparing import Deviations, compare, require_part_inside, sweep_tolerance
from fiveaxis.stock.dexels import UNCUT, Removal, Stock, default_resolution
from fiveaxis.stock.sources import fill, is_mesh_file, load_stock, read_stock, save_stock
from fiveaxis.stock.sweeping import Poses, Sweep, swept

__all__ = [
    "UNCUT",
    "Deviations",
    "Poses",
    "Removal",
    "Stock",
    "Sweep",
    "compare",
    "default_resolution",
    "fill",
    "is_mesh_file",
    "load_stock",
    "read_stock",
    "require_part_inside",
    "save_stock",
    "sweep_tolerance",
    "swept",
]
