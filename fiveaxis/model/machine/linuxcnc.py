"""Reading a machine from the configuration of its LinuxCNC control.

The ini names a kinematics module; the axes' lines follow from that module's C source
(``src/emc/kinematics``: trtfuncs.c, 5axiskins.c, maxkins.c) and the lengths that HAL commands set.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fiveaxis.model.machine.building import build_machine
from fiveaxis.model.machine.code import parse_code
from fiveaxis.model.machine.figures import LINEAR_UNITS, Table
from fiveaxis.model.machine.ini import UNFOUND, Configuration, Entry, Hal, read_configuration, read_hal
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.tables import MachineFile

NO_LIMIT = 1e99  # LinuxCNC's value for a missing limit
UNITS = {"mm": "mm", "metric": "mm", "in": "inch", "inch": "inch", "imperial": "inch"}
ENDS = {"MIN_LIMIT": "min", "MAX_LIMIT": "max"}
# Key -> table of a machine file, and its unit per time.
RATES = {
    "MAX_VELOCITY": ("max_speed", "s"),
    "MAX_ACCELERATION": ("max_acceleration", "s2"),
    "MAX_JERK": ("max_jerk", "s3"),
}
DEGREES = ("deg", "degree", "1", "1.0")


@dataclass(frozen=True)
class Kinematics:
    """Machine structure implied by a kinematics module.

    Parameters
    ----------
    code : form-shaping code; X, Y and Z commute, so the bed's place among them is a convention
    joints : letters of joint 0, 1, … unless the module's ``coordinates=`` says otherwise
    against : axes that count against ISO 841, unless the pin ``conventional-directions`` is set
    offsets : axis -> pins with the x, y, z of a point on its line; several entries of an axis add up
    pivot : default of the pin ``pivot-length``
    """

    code: str
    joints: str
    against: str = ""
    offsets: tuple[tuple[str, tuple[str, str, str]], ...] = ()
    pivot: float | None = None


ROTATION = ("x-rot-point", "y-rot-point", "z-rot-point")
PIVOT = ("", "", "pivot-length")
KINEMATICS = {
    "trivkins": Kinematics("0123", "XYZABCUVW"),
    # program = Rz(-c) [Rx(-a) (J - r - d) + d] + r: C lies in r, A in r + d; both turn the table by +angle.
    "xyzac-trt-kins": Kinematics(
        "640123", "XYZAC", "AC", (("A", ROTATION), ("A", ("", "y-offset", "z-offset")), ("C", ROTATION))
    ),
    "xyzbc-trt-kins": Kinematics(
        "650123", "XYZBC", "BC", (("B", ROTATION), ("B", ("x-offset", "", "z-offset")), ("C", ROTATION))
    ),
    # tip = J + L (sin b cos c, sin b sin c, -cos b) + L z: B turns the head by -b, C by +c.
    "5axiskins": Kinematics("021365", "XYZBCW", "B", (("B", PIVOT), ("C", ("", "", ""))), 250.0),
    # tip = Rz(c) (x + L sin b, y) and z - L cos b + L. Versions before 2026 add L sin b without turning it by
    # c, which no machine does.
    "maxkins": Kinematics("612035", "XYZABCUVW", "B", (("B", PIVOT), ("C", ("", "", ""))), 0.666),
}


@dataclass(frozen=True)
class Source:
    """A configuration with its kinematics, to be turned into the tables of a machine file."""

    ini: Configuration
    hal: Hal
    module: str
    kinematics: Kinematics
    named: Entry  # [KINS] KINEMATICS
    joints: str  # letter of joint 0, 1, …
    unit: str  # of lengths in the files, mm or inch


def read_linuxcnc(path: str | Path) -> Machine:
    """Read a machine from a LinuxCNC configuration, an ``.ini`` with its HAL files in the same folder.

    Axis values are tool relative to workpiece here; an axis that the control counts in the opposite direction
    is `reversed`, and its limits exchange ends and change sign. The limits of axis and joint both apply: the
    tighter one is taken, and likewise for speeds and accelerations. An ini has no powers, masses or shapes.

    Raises
    ------
    MachineError
        The file can't be read; the kinematics module is unknown or doesn't define the axes' lines; a unit, a
        number or a limit is impossible. The message has file and line.
    """
    ini = read_configuration(Path(path))
    named = ini.need("KINS", "KINEMATICS", "xyzac-trt-kins")
    module, *parameters = named.value.split() or [""]
    if module not in KINEMATICS:
        raise named.fault(
            f"kinematics {module!r} isn't known; known are {', '.join(KINEMATICS)}: write a machine file "
            "(.toml) with the code and its axes' lines"
        )
    kinematics = KINEMATICS[module]
    joints = kinematics.joints
    for parameter in parameters:
        if parameter.startswith("coordinates="):
            joints = parameter.removeprefix("coordinates=").upper()
    source = Source(ini, read_hal(ini), module, kinematics, named, joints, _linear_unit(ini))
    _require_letters(source)
    _require_types(source)
    return build_machine(MachineFile.model_validate(_machine_tables(source)), ini.file.parent)


def _linear_unit(ini: Configuration) -> str:
    entry = ini.need("TRAJ", "LINEAR_UNITS", "mm")
    word = entry.value.lower()
    if word in UNITS:
        return UNITS[word]
    per_mm = entry.number() if re.match(r"[-+.\d]", word) else 0.0
    for unit, length in LINEAR_UNITS.items():
        if unit in UNITS and abs(per_mm * length - 1.0) < 1e-3:  # 0.03937 is an inch
            return unit
    raise entry.fault(f"{entry.name} = {entry.value!r} must be one of {', '.join(UNITS)}")


def _require_letters(source: Source) -> None:
    """Raise if the control lacks an axis of the module, or has a rotary axis that the module doesn't."""
    known = parse_code(source.kinematics.code).letters
    stated = source.ini.need("TRAJ", "COORDINATES", "XYZAC")
    letters = stated.value.upper().replace(" ", "")
    extra = [c for c in "ABC" if c in letters and c not in known]
    if extra:
        raise stated.fault(
            f"{source.module} doesn't say where the rotary axes lie ({', '.join(extra)}): write a machine "
            "file (.toml) with the code and their lines"
        )
    for missing in sorted(set(known) - (set(letters) & set(source.joints))):
        at = stated if missing not in letters else source.named
        raise at.fault(f"{source.module} needs the axis {missing}, which {at.name} = {at.value} lacks")


def _require_types(source: Source) -> None:
    """Raise if a joint's type contradicts its letter, as in another joint order, or angles aren't in deg."""
    known = parse_code(source.kinematics.code).letters
    angles = source.ini.find("TRAJ", "ANGULAR_UNITS")
    if set(known) & set("ABC") and angles is not None and angles.value.lower() not in DEGREES:
        raise angles.fault(f"{angles.name} = {angles.value!r}: {source.module} counts in degrees, write deg")
    for number, letter in enumerate(source.joints):
        kind = source.ini.find(f"JOINT_{number}", "TYPE")
        wanted = "ANGULAR" if letter in "ABC" else "LINEAR"
        if letter in known and kind is not None and kind.value.upper() != wanted:
            raise kind.fault(
                f"{kind.name} = {kind.value}, but joint {number} of {source.module} is {letter} ({wanted}); "
                f"state the order of the joints: KINEMATICS = {source.module} "
                f"coordinates={source.kinematics.joints.lower()}"
            )


def _machine_tables(source: Source) -> Table:
    ini, kinematics = source.ini, source.kinematics
    title = ini.find("EMC", "MACHINE")
    name = ini.file.stem if title is None or not title.value else title.value
    note = "the module doesn't say which of X, Y and Z carry the table; the kinematics doesn't depend on it"
    letters = parse_code(kinematics.code).letters
    axes = {c: _axis_sections(source, c) for c in letters}
    unfound = [e for sections in axes.values() for s in sections for e in ini.passed_over(s, *ENDS, *RATES)]
    lines = ", ".join(f"{e.name} of line {e.line}" for e in unfound)
    ignored = f"; not in force: {lines}, as {UNFOUND}" if unfound else ""
    structure = {"source": f"{_cite([source.named])} ({source.module})", "assumed": True, "note": note}
    return {
        "name": ini.file.stem,
        "code": kinematics.code,
        "description": f"{name}: LinuxCNC configuration {ini.file.name} with {source.module}{ignored}",
        "structure": structure,
        "axes": {c: _axis_table(source, c, sections) for c, sections in axes.items()},
    }


def _axis_sections(source: Source, letter: str) -> list[str]:
    joints = (f"JOINT_{n}" for n, joint in enumerate(source.joints) if joint == letter)
    return [f"AXIS_{letter}", *joints]


def _axis_table(source: Source, letter: str, sections: list[str]) -> Table:
    unit = "deg" if letter in "ABC" else source.unit
    flag = source.hal.find(f"{source.module}.conventional-directions")
    flipped = letter in source.kinematics.against and not (flag is not None and flag.flag())
    table: Table = {"reversed": flipped}
    limits = _limits(source.ini, sections, flipped)
    if limits:
        table["limits"] = limits | {"unit": unit}
    for key, (figure, per) in RATES.items():
        tightest = min(_rates(source.ini, sections, key), key=lambda found: found[0], default=None)
        if tightest is not None:
            value, entry = tightest
            table[figure] = {"value": value, "unit": f"{unit}/{per}", "source": _cite([entry])}
    if letter in "ABC":
        table["line"] = _line(source, letter)
    return table


def _limits(ini: Configuration, sections: list[str], flipped: bool) -> Table:
    """Intersect the ranges of an axis and its joints; return an empty table if nothing limits it."""
    ends: dict[str, tuple[float, Entry]] = {}
    for section in sections:
        found = {}
        for key, end in ENDS.items():
            entry = ini.find(section, key)
            if entry is not None and abs(value := entry.number()) < NO_LIMIT:
                found[end] = (value, entry)
        _require_range(found)
        for end, limit in found.items():
            tighter = max if end == "min" else min
            ends[end] = tighter(ends.get(end, limit), limit, key=lambda pair: pair[0])
    _require_range(ends)
    if not ends:
        return {}
    values = {end: value for end, (value, _) in ends.items()}
    table: Table = {"source": _cite([entry for _, entry in ends.values()])}
    if flipped:
        own = ", ".join(f"{end} {value:g}" for end, value in values.items())
        table["note"] = f"{own} in the control's own sign"
        values = {{"min": "max", "max": "min"}[end]: -value for end, value in values.items()}
    return table | values


def _require_range(ends: dict[str, tuple[float, Entry]]) -> None:
    """Raise if limits are reversed, or if those of axis and joint don't overlap."""
    if len(ends) < 2 or ends["min"][0] < ends["max"][0]:
        return
    (low, below), (high, above) = ends["min"], ends["max"]
    if below.name.split()[0] == above.name.split()[0]:
        raise below.fault(f"{below.name} = {low:g} is not below MAX_LIMIT = {high:g}; exchange them")
    raise below.fault(
        f"{below.name} = {low:g} is not below {above.name} = {high:g}: the ranges of axis and joint don't "
        "overlap; correct one of them"
    )


def _rates(ini: Configuration, sections: list[str], key: str) -> Iterator[tuple[float, Entry]]:
    for section in sections:
        entry = ini.find(section, key)
        if entry is not None:
            value = entry.number()
            if value <= 0.0:
                raise entry.fault(f"{entry.name} = {value:g} must be above 0")
            yield value, entry


def _line(source: Source, letter: str) -> Table:
    """Locate a rotary axis by the point that the module's pins define."""
    point, entries, unset = [0.0, 0.0, 0.0], [], []
    for axis, pins in source.kinematics.offsets:
        for i, pin in enumerate(pins):
            if axis != letter or not pin:
                continue
            entry = source.hal.find(f"{source.module}.{pin}")
            value = (source.kinematics.pivot or 0.0) if entry is None else entry.number()
            point[i] += value * LINEAR_UNITS[source.unit]
            if entry is None:
                unset.append(f"{pin} {value:g}")
            else:
                entries.append(entry)
    origin = f"{_cite([source.named, *entries])} ({source.module})"
    if not unset:
        return {"point": point, "source": origin}
    table: Table = {"point": point, "source": f"{origin}; unset, so {', '.join(unset)}"}
    if source.hal.unread:
        note = f"{', '.join(source.hal.unread)} wasn't read and may set more"
        table |= {"assumed": True, "note": note}
    return table


def _cite(entries: list[Entry]) -> str:
    """Name the files of entries and, for each file, the entries' names."""
    names: dict[str, list[str]] = {}
    for entry in entries:
        names.setdefault(entry.file.name, []).append(entry.name)
    return "; ".join(f"{file} {', '.join(dict.fromkeys(found))}" for file, found in names.items())
