"""The machine: form-shaping code, chain, axes, bodies, setup, files."""

from fiveaxis.machine.axes import Axis, Limits, LocationError
from fiveaxis.machine.bodies import Body, Box, Cylinder, MeshShape
from fiveaxis.machine.chain import Chain, Joint, Line
from fiveaxis.machine.check import check_machine, check_text
from fiveaxis.machine.code import BED, FormShapingCode, parse_code
from fiveaxis.machine.drafting import Draft, draft_machine
from fiveaxis.machine.drives import AffineDrive, DirectionalDrive, Drive, FrictionDrive, WeightDrive
from fiveaxis.machine.files import load_machine, machine_names, machine_text, read_foreign, save_machine
from fiveaxis.machine.linuxcnc import read_linuxcnc
from fiveaxis.machine.model import Machine
from fiveaxis.machine.powers import describe_powers, lender_of, with_powers
from fiveaxis.machine.provenance import Provenance
from fiveaxis.machine.setup import Load, Setup

__all__ = [
    "BED",
    "AffineDrive",
    "Axis",
    "Body",
    "Box",
    "Chain",
    "Cylinder",
    "DirectionalDrive",
    "Draft",
    "Drive",
    "FormShapingCode",
    "FrictionDrive",
    "Joint",
    "Limits",
    "Line",
    "Load",
    "LocationError",
    "Machine",
    "MeshShape",
    "Provenance",
    "Setup",
    "WeightDrive",
    "check_machine",
    "check_text",
    "describe_powers",
    "draft_machine",
    "lender_of",
    "load_machine",
    "machine_names",
    "machine_text",
    "parse_code",
    "read_foreign",
    "read_linuxcnc",
    "save_machine",
    "with_powers",
]
