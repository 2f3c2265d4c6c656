"""Every word that the readers know, as a line that can stand between two cuts."""

from fiveaxis.nc.control import machine_functions, modal, technology
from fiveaxis.nc.languages import choice, klartext_state, sinumerik_state

# Klartext lines that the reader knows by their beginnings, each with what makes it whole.
LINES = """
* - FINISH
BLK FORM 0.1 Z X+0 Y+0 Z+0
TOOL DEF 7
STOP
LBL 1
SEL TABLE "A.T"
MONITORING ON
FUNCTION MODE MILL
FUNCTION RESET FEED
FUNCTION S-PULSE FROM-SPEED4800
FUNCTION FEED DWELL D-TIME0.5
FUNCTION COUNT RESET
FUNCTION DCM ON
FUNCTION FIXTURE SELECT
FUNCTION LIFTOFF ANGLE TCS SPB+20
FUNCTION CORRDATA RESET
FUNCTION PROG PATH IS CONTOUR
FUNCTION AFC CUT BEGIN
FN 15: PRINT 1
FN 16: F-PRINT A.A
FN 17: SYSWRITE ID210 NR1 IDX3 = +5
FN 0: Q2 = +5
Q1 = 5
FUNCTION TCPM F TCP AXIS SPAT PATHCTRL AXIS
FUNCTION RESET TCPM
PLANE RESET STAY
TOOL CALL S3000
TOOL CALL 5 Z S3000
TRANS DATUM AXIS Z+5
CC X+0 Y+0
L MB MAX
L M140 MB50
L M138 A C
"""
# Arguments without which a word says nothing else than is in force.
ARGUMENTS = {
    "G4": " P1",
    "G10": " L10 P5 R5",
    **dict.fromkeys(("G28", "G30", "G92"), " Z0"),
    "G53": " G0 Z0",
    **dict.fromkeys(("G54.1", "G154"), " P3"),
    **dict.fromkeys(("G43", "G43.4", "G43.5", "G234"), " H8"),
    "G68.2": " X0 Y0 Z0 I0 J20 K0",
    "G64": " P5",
    "G5.1": " Q1",
    "G187": " P1 E5",
    "G8": " P1",
    **dict.fromkeys(("G25", "G26"), " S100"),
    **dict.fromkeys(("G74", "G75"), " Z1=0"),
    **dict.fromkeys(("MSG", "CYCLE832", "SETMS", "FGROUP", "VELOLIM", "JERKLIM", "WORKPIECE"), "(5)"),
}


def iso() -> list[str]:
    """Return the G and M words of ISO programs, and assignments."""
    of_language = machine_functions.HARMLESS[choice.ISO.name] | machine_functions.SWITCHING.keys()
    words = {
        *modal.ACTING,
        *modal.HARMLESS,
        *modal.REFUSED,
        *modal.UNSUPPORTED,
        *technology.END,
        *of_language,
    }
    more = ["#1=5", "#501=5", "#5223=-5", "G64", "G5 P10000"]
    return [*(f"{word}{ARGUMENTS.get(word, '')}" for word in sorted(words)), *more]


def sinumerik() -> list[str]:
    """Return the words of Sinumerik programs, with values where they have one."""
    read = {*sinumerik_state.SAME_IN_ISO, *sinumerik_state.IGNORED_G, *sinumerik_state.REFUSED_G} - {4}
    numbers = [f"G{number}" for number in sorted({*read, 500, 53, 153})]
    fixed = [f"{word}{ARGUMENTS[word]}" for word in ("G25", "G26", "G74", "G75")]
    values = [f"{name}=5" for name in sorted(sinumerik_state.IGNORED_SETTINGS)]
    names = [f"{name}{ARGUMENTS.get(name, '')}" for name in sorted(sinumerik_state.IGNORED)]
    more = [
        "G4 F1",
        "SUPA G0 Z0",
        "TRAFOOF",
        "TRAORI",
        "TRAORI(2)",
        "TRANS Z5",
        "R1=5",
        "S2=500",
        "M2=3",
        "M21",
    ]
    return [
        *numbers,
        *fixed,
        *values,
        *names,
        *more,
        *sorted(machine_functions.HARMLESS[choice.SINUMERIK.name]),
    ]


def klartext() -> list[str]:
    """Return the lines of Klartext programs."""
    numbers = sorted(klartext_state.IGNORED_CYCLES - {247})
    cycles = [f"CYCL DEF {number}.{part} T5" for number in numbers for part in (0, 1)]
    names = machine_functions.HARMLESS[choice.KLARTEXT.name] | {f"M{n}" for n in klartext_state.REFUSED_M}
    words = sorted(names | {"M91", "M126", "M128", "M129", "M136"})
    return [*LINES.strip().splitlines(), *cycles, *(f"L {word}" for word in words)]


WORDS = {"fanuc": iso, "haas": iso, "linuxcnc": iso, "sinumerik": sinumerik, "heidenhain": klartext}
