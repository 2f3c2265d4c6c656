"""The stock as it is cut: rays of material, what a cutter sweeps of them, and the result beside the part."""

from fiveaxis.stock.comparing import Deviations as Deviations
from fiveaxis.stock.comparing import compare as compare
from fiveaxis.stock.comparing import require_part_inside as require_part_inside
from fiveaxis.stock.comparing import sweep_tolerance as sweep_tolerance
from fiveaxis.stock.cutting import Blank as Blank
from fiveaxis.stock.cutting import CutStock as CutStock
from fiveaxis.stock.cutting import cut_stock as cut_stock
from fiveaxis.stock.dexels import UNCUT as UNCUT
from fiveaxis.stock.dexels import Removal as Removal
from fiveaxis.stock.dexels import Stock as Stock
from fiveaxis.stock.dexels import default_resolution as default_resolution
from fiveaxis.stock.display import mesh_of as mesh_of
from fiveaxis.stock.sources import fill as fill
from fiveaxis.stock.sources import load_stock as load_stock
from fiveaxis.stock.sources import names_file as names_file
from fiveaxis.stock.sources import names_mesh as names_mesh
from fiveaxis.stock.sources import read_stock as read_stock
from fiveaxis.stock.sources import save_stock as save_stock
from fiveaxis.stock.sweeping import Poses as Poses
from fiveaxis.stock.sweeping import Sweep as Sweep
from fiveaxis.stock.sweeping import swept as swept
