"""APT of each CAM system: one short file of each."""

import numpy as np
import pytest

from fiveaxis.model import MoveKind
from fiveaxis.nc import read_toolpath

CUT, RAPID = MoveKind.CUT, MoveKind.RAPID

NX = """\
TOOL PATH/CONTOUR_1,TOOL,BALL_10
TLDATA/MILL,10.0000,5.0000,75.0000,0.0000,0.0000
MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
$$ centerline data
PAINT/PATH
PAINT/SPEED,10
LOAD/TOOL,1,ADJUST,1
PAINT/COLOR,186
RAPID
GOTO/0.0000,10.0000,50.0000,0.0000000,0.0000000,1.0000000
PAINT/COLOR,42
FEDRAT/MMPM,250.0000
GOTO/0.0000,10.0000,0.0000
PAINT/COLOR,31
CIRCLE/10.0000,10.0000,0.0000,0.0000000,0.0000000,-1.0000000,10.0000,0.0600,0.5000,10.0000,5.0000
GOTO/10.0000,0.0000,0.0000
GOTO/20.0000,0.0000,0.0000,0.6000000,0.0000000,0.8000000
GOTO/30.0000,0.0000,0.0000
PAINT/SPEED,10
PAINT/TOOL,NOMORE
END-OF-PATH
TOOL PATH/DRILLING_1,TOOL,BALL_10
TLDATA/MILL,10.0000,5.0000,75.0000,0.0000,0.0000
MSYS/0.0000,0.0000,5.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
LOAD/TOOL,1
CYCLE/DRILL,RAPTO,3.0000,FEDTO,-10.0000,RTRCTO,AUTO,MMPM,120.0000
GOTO/40.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000
CYCLE/OFF
END-OF-PATH
"""

CREO = """\
$$*         Pro/CLfile  Version 9.0 - 9.0.0.0
$$-> MFGNO / MFG0001
PARTNO / MFG0001
$$-> FEATNO / 40
MACHIN / UNCX01, 1
$$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_CENTER
UNITS / MM
PPWORD / G05
LOADTL / 1
$$-> CUTTER / 10.000000
$$-> CSYS / 1.0000000000, 0.0000000000, 0.0000000000, 0.0000000000, $
            0.0000000000, 1.0000000000, 0.0000000000, 0.0000000000, $
            0.0000000000, 0.0000000000, 1.0000000000, 0.0000000000
MULTAX / ON
SPINDL / RPM, 1000.000000,  CLW
RAPID
GOTO / 0.0000000000, 0.0000000000, 50.0000000000, $
0.6000000000, 0.0000000000, 0.8000000000
FEDRAT / 100.000000, MMPM
GOTO / 1.0000000000, 2.0000000000, 3.0000000000
MULTAX / OFF
CYCLE / DRILL, DEPTH, 10.000000, MMPM, 50.000000, CLEAR, 5.000000
GOTO / 5.0000000000, 0.0000000000, 20.0000000000
CYCLE / OFF
$$-> END /
FINI
"""

CATIA = """\
$$ -----------------------------------------------------------------
$$     Generated on Monday, March 2, 2026 10:00:00 AM
$$     CATIA APT VERSION 1.0
$$ -----------------------------------------------------------------
$$ Manufacturing Program.1
$$ Part Operation.1
$$*CATIA0
$$ Manufacturing Program.1
$$    1.00000     0.00000     0.00000     0.00000
$$    0.00000     1.00000     0.00000     0.00000
$$    0.00000     0.00000     1.00000     0.00000
PARTNO Part Operation.1
COOLNT/ON
CUTCOM/OFF
PPRINT OPERATION NAME : Tool Change.1
$$ TOOLCHANGEBEGINNING
CUTTER/ 10.000000,  2.000000,  3.000000,  2.000000,  0.000000,$
         0.000000, 50.000000
TOOLNO/1,MILL,1,0,   60.000000,,   10.000000,,  100.000000,$
   60.000000,,   50.000000,    0.000000,4, 1000.000000,MMPM,$
   70.000000,RPM,CLW,ON,AUTO,    0.000000,NOTE
TPRINT/T1 End Mill D 10,,T1 End Mill D 10
LOADTL/1,1,1
$$ TOOLCHANGEEND
TLAXIS/ 0.000000, 0.000000, 1.000000
SPINDL/   70.0000,RPM,CLW
FEDRAT/ 1000.0000,MMPM
RAPID
GOTO  /   10.00000,    0.00000,   20.00000
GOTO  /   10.00000,    0.00000,    0.00000
AUTOPS
INDIRV/   0.00000,   1.00000,   0.00000
TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$
   10.00000),ON,(LINE/    0.00000,    0.00000,    0.00000,$
    0.00000,   10.00000,    0.00000)
MULTAX
GOTO  /  -10.00000,   10.00000,    0.00000, 0.600000, 0.000000, 0.800000
$$ End of generation of : Profile Contouring.1
SPINDL/OFF
REWIND/0
END
"""

SOLIDWORKS = """\
PARTNO/1
UNIT/MM
INSERT/[HOLDER=C40-M06EM2] 6MM CRB 2FL 19 LOC
CUTTER/6.,3.,0,3.,0,0,51.
LOAD/TOOL,1
COOLNT/FLOOD
SPINDL/12000,RPM,CLW
TRNTYP/WORLD,0,0,0
CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0
RAPID/
GOTO/10.,0,25.
FEDRAT/411.48,MMPM
GOTO/10.,0,-3.
FEDRAT/1645.92,MMPM
CIRCLE/0,0,-3.,0,0,1.
GOTO/0,10.,-3.
CSYS/0,0,1.,0,1.,0,0,0,0,1.,0,0
GOTO/.5,10.,-3.,1.,0,0
FINI
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text, suffix, operation=None):
        path = tmp_path / f"part{suffix}"
        path.write_text(text, encoding="utf-8")
        return read_toolpath(path, operation=operation)

    return read_text


def tips(path):
    return path.tips(path.axis)


def line_of(text, statement):
    return text.splitlines().index(statement) + 1


def at_line(path, line):
    return np.flatnonzero(path.source == line)


def test_a_file_of_nx(read):
    path, holes = (read(NX, ".cls", operation=number) for number in (1, 2))
    assert (path.operation.kind, holes.operation.kind) == ("simultaneous", "drilling")
    assert str(path.tool) == "ball:10"
    arc = at_line(path, line_of(NX, "GOTO/10.0000,0.0000,0.0000"))
    assert len(arc) > 10, "the arc is sampled"
    middle = tips(path)[arc]
    assert np.all(middle[:, 0] <= 10), "the shorter arc: it turns counterclockwise about -z"
    np.testing.assert_allclose(np.linalg.norm(middle - [10, 10, 0], axis=1), 10)
    tilted = at_line(path, line_of(NX, "GOTO/30.0000,0.0000,0.0000"))
    np.testing.assert_allclose(path.axis[tilted], [[0.6, 0, 0.8]], err_msg="the vector is modal")
    np.testing.assert_allclose(tips(holes)[-3:], [[40, 0, 8], [40, 0, -5], [40, 0, 8]], atol=1e-12)
    assert [*path.kind[[0, 1]], *holes.kind[-3:]] == [RAPID, CUT, RAPID, CUT, RAPID]
    np.testing.assert_allclose([path.feed[1] * 60, holes.feed[-2] * 60], [250, 120])
    assert [f.code for f in path.findings] == ["frame-mapped", "unit-assumed"]
    assert path.ignored == {
        "END-OF-PATH": 2, "LOAD": 2, "MSYS": 2, "PAINT": 7, "TOOL PATH": 2,
    }  # fmt: skip


def test_a_file_of_creo(read):
    path, holes = (read(CREO, ".ncl", operation=number) for number in (1, 2))
    assert str(path.tool) == str(holes.tool) == "flat:10"
    expected = [[0, 0, 50], [1, 2, 3], [5, 0, 25], [5, 0, 10], [5, 0, 25]]
    np.testing.assert_allclose([*tips(path), *tips(holes)], expected)
    axes = [[0.6, 0, 0.8], *[[0, 0, 1]] * 4]
    np.testing.assert_allclose([*path.axis, *holes.axis], axes, err_msg="upright without a vector")
    assert [*path.kind, *holes.kind] == [RAPID, CUT, RAPID, CUT, RAPID]
    assert path.ignored == {
        "$$->CSYS": 1, "$$->CUTCOM_GEOMETRY_TYPE": 1, "$$->END": 1, "$$->FEATNO": 1, "$$->MFGNO": 1,
        "FINI": 1, "LOADTL": 1, "MACHIN": 1, "MULTAX": 2, "PARTNO": 1, "PPWORD": 1, "SPINDL": 1,
    }  # fmt: skip
    assert [f.code for f in path.findings] == []


def test_a_file_of_catia(read):
    path = read(CATIA, ".aptsource")
    assert str(path.tool) == "bull:10:2"
    assert path.kind[:2].tolist() == [RAPID, CUT]
    arc = at_line(path, line_of(CATIA, "TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$"))
    np.testing.assert_allclose(np.linalg.norm(tips(path)[arc], axis=1), 10)
    np.testing.assert_allclose(tips(path)[arc[-1]], [0, 10, 0], atol=1e-9)
    assert np.all(tips(path)[arc][:, :2] > -1e-9), "a quarter, not three"
    np.testing.assert_allclose(path.axis[[0, -1]], [[0, 0, 1], [0.6, 0, 0.8]])
    np.testing.assert_allclose(path.feed * 60, 1000)
    assert [f.code for f in path.findings] == ["unit-assumed"]
    assert path.ignored["$$*CATIA0"] == 1
    assert path.ignored["TOOLNO"] == 1


def test_a_file_of_solidworks(read):
    path = read(SOLIDWORKS, ".apt")
    assert str(path.tool) == "ball:6"
    arc = at_line(path, line_of(SOLIDWORKS, "GOTO/0,10.,-3."))
    assert np.all(tips(path)[arc][:, :2] > -1e-9), "a quarter, not three"
    np.testing.assert_allclose(tips(path)[-1], [0.5, 10, -3])
    np.testing.assert_allclose(path.axis[-1], [1, 0, 0])
    assert [f.code for f in path.findings] == ["frame-unused", "axis-assumed"]
