"""The machine: form-shaping code, chain, axes, files."""

from fiveaxis.machine.axes import Axis, DirectionalDrive, Limits
from fiveaxis.machine.chain import Chain, Joint, Line
from fiveaxis.machine.code import FormShapingCode, parse_code
from fiveaxis.machine.files import load_machine, machine_names
from fiveaxis.machine.model import Machine, Provenance

__all__ = [
    "Axis",
    "Chain",
    "DirectionalDrive",
    "FormShapingCode",
    "Joint",
    "Limits",
    "Line",
    "Machine",
    "Provenance",
    "load_machine",
    "machine_names",
    "parse_code",
]
