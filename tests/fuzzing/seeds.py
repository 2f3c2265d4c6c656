"""Inputs that readers accept: parts of our own programs and of real files, and short ones written here."""

import gzip
import re
from collections.abc import Iterator
from pathlib import Path

import trimesh

from fiveaxis.job.guide import starter_text

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden"
DATA = ROOT.parent / "shared" / "data"  # the real inputs, where they are beside this checkout
# Lines of a seed: damage of one line in a thousand would find nothing.
HEAD = 30
# Most lines of a program's head are comments, of which a few are enough.
COMMENT, COMMENTS = re.compile(rb"\s*(?:N?\d+\s+)?[(;]"), 3


def parts(*patterns: str, head: int = HEAD) -> tuple[bytes, ...]:
    """Return beginnings, middles and ends of files, short enough that damage meets what matters."""
    found = (path for pattern in patterns for path in sorted((*GOLDEN.glob(pattern), *DATA.glob(pattern))))
    return tuple(part for path in found for part in _parts_of(path, head))


def _parts_of(path: Path, head: int) -> Iterator[bytes]:
    content = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    lines = content.splitlines()
    comments = [line for line in lines if COMMENT.match(line)]
    lines = [line for line in lines if not COMMENT.match(line) or line in comments[:COMMENTS]]
    yield b"\n".join(lines[:head])
    if len(lines) > 3 * head:
        yield b"\n".join([*lines[: head // 2], *lines[len(lines) // 2 :][: head // 2], *lines[-5:]])


def meshes(kind: str, **options: object) -> tuple[bytes, ...]:
    """Write a box and a pyramid in a format of meshes."""
    made = [trimesh.creation.box((1, 2, 3)), trimesh.creation.cone(1.0, 2.0, sections=4)]
    texts = [mesh.export(file_type=kind, **options) for mesh in made]
    return tuple(text.encode() if isinstance(text, str) else text for text in texts)


def texts_in(folder: str, *names: str) -> tuple[bytes, ...]:
    """Read the TOML files of a folder of this checkout."""
    return tuple((ROOT / folder / f"{name}.toml").read_bytes() for name in names)


# Words that a program may have, and that our own programs don't.
BLOCKS = tuple(
    b"G1 G0 G2 G3 G93 G94 G95 G43.4 G43.5 G68.2 G53.1 G10 G30 G53 G91 G90 G28 G81 G83 G41 G16 G5 M428 M451 "
    b"M128 M98 #1= WHILE GOTO O100 [SIN[ R5 P2 L3 Q1 I1 J1 K1 T01 M6 M30 F0 S0 / ; ( ) % =".split()
)
CAD = tuple(path.read_bytes() for path in sorted(GOLDEN.glob("cad_*.step")))
OBJ_WORDS = (b"mtllib", b"usemtl", b"vt", b"vn", b"l", b"g", b"//", b"s")
STARTER = re.sub(r"(?m)^# (?=\[|[\w.]+ = )", "", starter_text()).encode()
JOBS = (
    b"""input = "part.stl"
tool = "ball:8"
tilt = [15, 75]
control = "fanuc"
[plan]
stepdown = 1
""",
    b"""input = "path.csv"
feed = 500
singular_cone = 3
hold = { C = 30 }
[setup]
offset = [0, 1, 2]
[setup.search]
x = [-5, 5]
[program]
start = { X = 1 }
[[fixture]]
name = "a"
box = { size = [1, 2, 3] }
""",
    b"""input = "path.csv"
tool = "taper:4:5:10"
cone = 30
[nc]
spindle_rpm = 9000
[clearance]
holder = 2
[process]
teeth = 2
helix = 30
depth = 1
width = 1
spindle_rpm = 9000
tangential = 900
basis = "measured"
source = "own"
[factors]
price = 0.3
source = "own"
""",
)
SWEEPS = (
    b"""input = "path.csv"
[sweep]
combine = "zip"
tilt = [[15, 75], [20, 60]]
feed = [100, 200]
""",
    b"""input = "path.csv"
[plan]
stepdown = 1
[sweep]
combine = "product"
plan.stepdown = [1, 2]
tool = ["a", "b"]
""",
)
FIXTURES = (
    b"""[[fixture]]
name = "left"
box = { size = [1, 2, 3], center = [0, 0, 1] }
[clearance]
shank = 0.5
""",
    b"""[[fixture]]
name = "vice"
mesh = "vice.stl"
scale = 25.4
[[fixture]]
name = "post"
cylinder = { radius = 3, height = 9, direction = [0, 0, 1] }
""",
)
ROWS = range(60)
LOGS = (
    b"t,x,v,a,p\n"
    + b"".join(b"%d,%d,%d.5,%d,%d\n" % (i, i * i, (-1) ** i * (2 * i + 9), i % 3, 99 + 7 * i) for i in ROWS),
    b"# log\np;v;a;x;t\n" + b"".join(b"%d;-%d;%d;1e-3;%d.1\n" % (90 + i, i, i % 2, i) for i in ROWS),
)
VERICUT = (
    b"""CGTech Machine
UNITS MILLIMETER
COMPONENT "Base" { COMPTYPE "Base"
ORIGIN (0,0,0) ROTATION (0,0,0)
}
COMPONENT "C" { COMPTYPE "Rotation" CONNECT "Base"
ORIGIN (0,0,50) ROTATION (-45,0,0)
LINK { AXIS Z REGISTER "C"
TL_MIN -120 TL_MAX 30 TL_IGNORE FALSE } }
COMPONENT "Stock" { COMPTYPE "Stock" CONNECT "C"
ORIGIN (0,0,0) ROTATION (45,0,0)
}
COMPONENT "X" { COMPTYPE "Translation" CONNECT "Base"
ORIGIN (250,0,0) ROTATION (0,0,0)
LINK { AXIS X REGISTER "X"
TL_MIN -500 TL_MAX 0 } }
COMPONENT "Tool" { COMPTYPE "Tool" CONNECT "X"
ORIGIN (0,0,0) ROTATION (0,0,0)
}
""",
    b"""<?xml version="1.0"?>
<VcMachine Version="7.0" Unit="millimeter">
<Component Name="Base" Type="base"><Attach></Attach><Position X="0" Y="0" Z="0"/></Component>
<Component Name="A" Type="rotary"><Attach>Base</Attach><Position X="0" Y="0" Z="50"/>
<Rotation I="0" J="0" K="0"/><Link Axis="X" Register="A">
<TlRecord TlMin="-120" TlMax="30" TlIgnore="off"/></Link></Component>
<Component Name="Attach" Type="attach"><Attach>A</Attach></Component>
<Component Name="Z" Type="linear"><Attach>Base</Attach><Link Axis="Z" Register="Z"></Link></Component>
<Component Name="Tool" Type="tool"><Attach>Z</Attach></Component>
</VcMachine>
""",
)
# Question, axis letter if it has one, and answer, line by line.
ANSWERS = (
    b"structure= 640123\nlimits=X -300:300\nlimits=A -120:30\ncounts=A table\npoints=A 0,5,50\n"
    b"speeds=X 40 m/min\nmasses=X 0.9 t\nmotors=Y 11 A 400 V\nmass= 8 t\nbase-power= 1.5 kW\n",
    b"name= mill\nstructure= nutating-head\nvertical= -Z\nlimits=C endless\nspindle= 0 0 1e2\n"
    b"accelerations=B 500 deg/s2\nsize= portal\n",
)
INI = b"""[KINS]
KINEMATICS = xyzac-trt-kins
JOINTS = 5
[TRAJ]
LINEAR_UNITS = mm
ANGULAR_UNITS = deg
COORDINATES = XYZAC
[HAL]
HALCMD = setp xyzac-trt-kins.y-offset 20
HALCMD = net :z xyzac-trt-kins.z-offset
HALCMD = sets :z 10
[AXIS_X]
MIN_LIMIT = -200
MAX_LIMIT = 200
MAX_VELOCITY = 20
[AXIS_C]
MIN_LIMIT = -36000
MAX_LIMIT = 36000
[JOINT_0]
TYPE = LINEAR
MAX_ACCELERATION = 300
"""
TOOL_FILE = b"""shape = "bull"
diameter = 16
corner_radius = 4
length = 30
shank_diameter = 16
[holder]
stick_out = 60
sections = [
  { length = 20, diameter = 32 },
  { length = 40, diameter = 50, upper_diameter = 63 },
]
"""
TOOLS = tuple(b"ball:10 flat:10 bull:16:4 lollipop:8:5 taper:4:5:10 barrel:16:85:3 drill:8:118".split())
RESULTS = b"""{"name": "a", "file": "a.toml", "status": "fine", "values": {"tilt": [15, 75]}, "files": ["x"]}
{"name": "b", "file": "b.toml", "status": "wrong input", "message": "m", "before": {"name": "b"}}
"""
OPTIONS = (
    *(b"setup x=-50:50,angle=-180:180", b"setup x=1:2", b"numbers 1,2,3", b"start X18,Y74,Z0"),
    b"start G55X18,G54.1P3Z-2",
)
CODES = (b"640123", b"650123", b"021365")
POINTS = (
    b"x,y,z,nx,ny,nz,feed,cut,rapid\n1,2,3,0,0,1,9,1,0\n1,2,9,0,0,1,9,0,1\n",
    b"x,y,z,i,j,k\n1,2,3,0,0,1\n2,2,3,0,0.6,0.8\n2,3,3,0,0,1\n",
)
WAYPOINTS = b"1 2 3 0 0 1\n4 5 6 0 0.6 0.8\n"
# Subprograms, repeated parts, loops and drilling cycles.
KLARTEXT = b"""0 BEGIN PGM A MM
1 TOOL CALL 1 Z S1000 F300
2 Q1 = 3
3 L X+0 Y+0 Z+50 B+0 C+0 FMAX M3
4 CYCL DEF 200 DRILLING ~
  Q200=+2 ;SET-UP CLEARANCE ~
  Q201=-15 Q206=AUTO Q203=+Q1 Q204=+50
5 L X+10 Y+5 FMAX M99
6 LBL 1
7 L IX+5 FMAX M89
8 CALL LBL 2
9 CALL LBL 1 REP 2
10 CYCL CALL POS X+1 Y+2 Z+0 FMAX
11 L Z+60 FMAX M30
12 LBL 2
13 L Y+Q1 F500
14 FN 1: Q1 = +Q1 + +2
15 LBL 0
16 END PGM A MM
"""
ISO = b"""%
O1000 (PART)
G21 G90 G54 G0 X0 Y0 Z50. A0 C0
#1=0 #<a>=3
WHILE [#1 LT 2.5] DO1
#1=#1+1
G1 X#1 Y[SIN[#1*10]] F500
END1
IF [#1 EQ 3] GOTO 20
X99
N20 M98 P2 L2
G52 X5
G65 P2 A1 X2.5
o100 repeat [2]
G91 G1 Z-1
o100 endrepeat
G90 M97 P30
G92 X0
M30
N30 G1 Y9. M99
O2
G1 Z[ATAN[1]/[2]]
M99
%
"""
ISO_WORDS = tuple(
    b"G65 M97 M99 O2 DO1 END1 THEN IF [ ] LT EQ MOD FIX o100 sub endsub call while G52 G92 G254".split()
)
KLARTEXT_WORDS = tuple(b"M94 REP LBL CALL PGM INPUT M99 M89 CYCL DEF 207 Q239 FMAX 247 QL1 FN 18 ~".split())
SINUMERIK = b"""R1=0 R2=3
G54 G0 X0 Y0 Z50 B=0 C=0
FOR R3=1 TO R2
PART: G1 X=R3 Y=R1 F500
R1=R1+1
ENDFOR
REPEAT
R1=R1-1
X=R1
UNTIL R1<=0
WHILE R1<2
R1=R1+1
ENDWHILE
LAST: Y5
REPEAT LAST P=2
MCALL CYCLE81(50,0,3,-15)
X1
MCALL
G0 Z50
M30
"""
SINUMERIK_WORDS = tuple(
    b'REPEAT FOR TO ENDFOR UNTIL WHILE ENDWHILE P= INPUT CALL "INPUT" L12 M17 RET IF == <>'.split()
)
# One operation each, as a program of several is refused: a tilted plane with a shift, an arc and cycles; TCP.
MILLPLUS = (
    b"""%
O9001 (PART)
N1 G40
N2 G71
N3 G54 I1
N4 G74 Z-.1 L1
N5 G174
N6 T1 M6
N7 S5000 M3
N8 G93 X1. Y-2. Z3.
N9 G90
N10 G7 A5=15. B5=0.0 C5=210. B7=254 C7=255
N11 G0 B=E254 C=E255
N12 X=10. Y0 Z20.
N13 G94
N14 G1 Z5. F500
/N15 X10.5
N16 X10.
N17 G3 X0 Y10. I10. J0
N18 G81 Y1. Z-5. B9. F200
N19 G79 X1. Y2. Z3.
N20 G84 Y2. Z-4. F100
N21 G79 X4.
N22 M30
""",
    b"""%PM9002
N9002
N1 G17
N2 G54 I1
N3 G71
N4 G7 A5=0.0 B5=0.0 C5=0.0 L1=1
N5 T2 M6
N6 S5000 M3
N7 G0 B-10. C20.
N8 G141 L2=0 F2=15000.
N9 X1. Y2. Z30.
N10 G1 X2. B-12. C25. F300
N11 Y5. C30.
N12 G0 Z60.
N13 G40
N14 M30
""",
)
