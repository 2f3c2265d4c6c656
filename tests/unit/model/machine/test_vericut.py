"""Machines read from Vericut templates, against the library's machines of the same figures."""

from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError
from fiveaxis.model import Machine, load_machine, tool_poses

# Figures of Vericut/MachineTemplate, in the form of its files: dmu50ev_6n.mch (version 6, text) …
TEXT = """\
CGTech Machine
Version-6.2

UNITS MILLIMETER

MACHINE "" {
	COMPONENT "Base" {
		COMPTYPE "Base"
		ORIGIN (0,0,0) ROTATION (0,0,0)
		ASSEMBLY {
			POLY_FILE "base.ply" MILLIMETER {
				ORIGIN (7,8,9) ROTATION (10,20,30)
			}
		}
	}
	COMPONENT "B" {
		COMPTYPE "Rotation"
		CONNECT "Base"
		ORIGIN (0,0,155) ROTATION (-45,0,0)
		LINK {
			AXIS Y REGISTER "B"
			RAPID_RATE 5000 INTERPOLATED_POS TRUE
			TL_GROUP 0 TL_COMP "B" TL_MIN 0 TL_MAX 180 TL_COMP_COND "" TL_MIN_COND 0 TL_IGNORE FALSE
			ACCELERATION 125
		}
	}
	COMPONENT "C" {
		COMPTYPE "Rotation"
		CONNECT "B"
		ORIGIN (0,109.601551084,-109.601551084) ROTATION (45,0,0)
		LINK {
			AXIS Z REGISTER "C"
			TL_GROUP 0 TL_COMP "C" TL_MIN -29999 TL_MAX 29999 TL_COMP_COND "" TL_IGNORE FALSE
		}
	}
	PRE60_COMPONENT "Stock" {
		COMPTYPE "Stock"
		CONNECT "C"
		ORIGIN (0,0,0) ROTATION (0,0,0)
	}
	COMPONENT "X" {
		COMPTYPE "Translation"
		CONNECT "Base"
		ORIGIN (250,0,0) ROTATION (0,0,0)
		LINK {
			AXIS X REGISTER "X"
			TL_GROUP 0 TL_COMP "X" TL_MIN -500 TL_MAX 0 TL_IGNORE FALSE
		}
	}
	COMPONENT "Y" {
		COMPTYPE "Translation"
		CONNECT "X"
		ORIGIN (0,155,0) ROTATION (0,0,0)
		LINK {
			AXIS Y REGISTER "Y"
			TL_GROUP 0 TL_COMP "Y" TL_MIN -420 TL_MAX 0 TL_IGNORE FALSE
		}
	}
	COMPONENT "Z" {
		COMPTYPE "Translation"
		CONNECT "Y"
		ORIGIN (0,0,542) ROTATION (0,0,0)
		LINK {
			AXIS Z REGISTER "Z"
			TL_GROUP 0 TL_COMP "Z" TL_MIN -380 TL_MAX 0 TL_IGNORE FALSE
		}
	}
	COMPONENT "Tool" {
		COMPTYPE "Tool"
		CONNECT "Z"
		ORIGIN (0,0,0) ROTATION (0,0,0)
		TURRET_INDEX 1
		LINK {
			AXIS Z
		}
	}
}
"""
# … mazak_v7.mch (version 7, XML) and, in that form, DMU80PduoBLOCK_6.mch: name, type, parent, position, angle
# about x, axis, limits.
MAZAK = [
    ("Base", "base", "", (0, 0, 0), 0, "", None),
    ("X", "linear", "Base", (315, 0, 0), 0, "X", (-630, 0)),
    ("Y", "linear", "X", (0, 315, 0), 0, "Y", (-765, 0)),
    ("Z", "linear", "Y", (0, 0, 740), 0, "Z", (-510, 0)),
    ("Tool", "tool", "Z", (0, 0, 0), 0, "Z", None),
    ("A", "rotary", "Base", (0, 0, 50), 0, "X", (-120, 30)),
    ("C", "rotary", "A", (0, 0, -50), 0, "Z", None),
    ("Attach", "attach", "C", (0, 0, 0), 0, "", None),
]
DUOBLOCK = [
    ("Base", "base", "", (0, 0, 0), 0, "", None),
    ("Y", "linear", "Base", (0, -500, 0), 0, "Y", (-800, 0)),
    ("C", "rotary", "Y", (0, 0, 0), 0, "Z", (-29999, 29999)),
    ("Attach", "attach", "C", (0, 0, 0), 0, "", None),
    ("X", "linear", "Base", (-400, 0, 0), 0, "X", (0, 800)),
    ("Z", "linear", "X", (0, 0, 950), 0, "Z", (-800, 0)),
    ("B", "rotary", "Z", (0, 365, 265), 45, "Y", (-10, 180)),
    ("Spindle", "spindle", "B", (0, -445.477272148, 70.710678119), -45, "Z", None),
    ("Tool", "tool", "Spindle", (0, 0, 0), 0, "Z", None),
]


def xml_text(rows) -> str:
    lines = ['<?xml version="1.0"?>', '<VcMachine Version="7.0" Unit="millimeter">']
    for name, kind, parent, (x, y, z), angle, axis, limits in rows:
        lines += [f'<Component Name="{name}" Subsystem="1"', f' Type="{kind}" Visible="machine">']
        lines += [f"<Attach>{parent}</Attach>", f'<Position X="{x}" Y="{y}" Z="{z}"/>']
        lines.append(f'<Rotation I="{angle}" J="0" K="0"/>')
        if axis:
            low, high = limits or (0, 0)
            ignored = "off" if limits else "on"
            lines.append(f'<Link Axis="{axis}" Register="{name}" RapidRate="25400" Accel="250">')
            lines.append(
                f'<TlRecord TlComp="{name}" TlMin="{low}" TlMax="{high}" TlIgnore="{ignored}"/></Link>'
            )
        lines.append("</Component>")
    return "\n".join([*lines, "</VcMachine>", ""])


def read(folder: Path, text: str) -> Machine:
    path = folder / "template.mch"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


def assert_same_poses(one: Machine, other: Machine) -> None:
    values = np.random.default_rng(7).uniform(-3.0, 3.0, (100, len(one.axes)))
    for a, b in zip(tool_poses(one, values), tool_poses(other, values), strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-8)


def test_a_text_of_version_6_is_the_library_s_nutating_table(tmp_path):
    machine, known = read(tmp_path, TEXT), load_machine("dmu50ev")
    assert machine.code == known.code
    # The library's sense of B rests on an NX program, not on the template.
    assert_same_poses(machine, known)
    for letter in "XYZ":
        assert machine.axis(letter).limits == known.axis(letter).limits
    assert machine.axis("C").limits.unlimited


@pytest.mark.parametrize(("rows", "name"), [(MAZAK, "variaxis-630"), (DUOBLOCK, "dmu80p-duoblock")])
def test_an_xml_of_version_7_is_the_library_s_machine(rows, name, tmp_path):
    machine, known = read(tmp_path, xml_text(rows)), load_machine(name)
    assert machine.code == known.code
    assert_same_poses(machine, known)
    assert [a.limits for a in machine.axes] == [a.limits for a in known.axes]


def test_the_sense_of_a_table_s_axes_is_an_assumption(tmp_path):
    origins = {p.figure: p for p in read(tmp_path, TEXT).provenance}
    assert origins["B limits"].assumed
    assert "sense" in origins["B limits"].note
    assert not origins["X limits"].assumed


def test_the_rates_that_the_program_sets_by_itself_are_not_read(tmp_path):
    machine = read(tmp_path, TEXT)
    assert [a.max_speed for a in machine.axes] == [None] * 5
    assert [a.max_acceleration for a in machine.axes] == [None] * 5


def test_limits_have_other_words_in_version_6_0(tmp_path):
    text = TEXT
    for word, former in (("TL_MIN ", "MIN_LIMIT "), ("TL_MAX ", "MAX_LIMIT "), ("TL_IGNORE", "IGNORE_LIMIT")):
        text = text.replace(word, former)
    assert text != TEXT
    newer = read(tmp_path, TEXT)
    assert [a.limits for a in read(tmp_path, text).axes] == [a.limits for a in newer.axes]


def test_inches_are_read(tmp_path):
    machine = read(tmp_path, TEXT.replace("MILLIMETER\n\nMACHINE", "INCH\n\nMACHINE"))
    assert machine.axis("X").limits.low == pytest.approx(-500 * 25.4)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("CGTech Machine", "CGTech Control", "no Vericut machine"),
        ("UNITS MILLIMETER", "UNITS FURLONG", "unit 'FURLONG'"),
        (
            "ROTATION (-45,0,0)",
            "ROTATION (-45,10,0)",
            r"template\.mch:16: component 'B' is turned by \(-45, 10, 0\)",
        ),
        ('CONNECT "B"', 'CONNECT "D"', r"template\.mch:27: 'C' hangs on 'D', which isn't there"),
        ('CONNECT "Base"\n\t\tORIGIN (0,0,155)', 'CONNECT "C"\n\t\tORIGIN (0,0,155)', "hangs on itself"),
        ('REGISTER "B"', 'REGISTER "Q"', "register 'Q'; A, B or C is expected"),
        ("AXIS Y REGISTER", "AXIS W REGISTER", "moves along 'W'"),
        ("TL_MIN -500 TL_MAX 0", "TL_MIN 0 TL_MAX -500", "limits 0 … -500; exchange them"),
        ("TL_MIN -500", "TL_MIN nan", "limits nan … 0, not two numbers"),
        ('COMPTYPE "Tool"', 'COMPTYPE "Other"', "lacks a component"),
        ('COMPONENT "Y"', 'COMPONENT "X"', "two components 'X'"),
        ("ORIGIN (250,0,0)", "ORIGIN (250,0)", "not three numbers"),
        ('AXIS Y REGISTER "Y"', 'AXIS X REGISTER "Y"', "which isn't axis Y"),
    ],
)
def test_a_damaged_text_is_one_message_with_its_place(tmp_path, old, new, fault):
    assert old in TEXT
    with pytest.raises(MachineError, match=fault):
        read(tmp_path, TEXT.replace(old, new, 1))


def test_xml_that_is_none_is_one_message_with_its_line(tmp_path):
    with pytest.raises(MachineError, match=r"template\.mch:\d+: isn't XML"):
        read(tmp_path, xml_text(MAZAK)[:400])
