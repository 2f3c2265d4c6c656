"""Vocabulary of Sinumerik 840D: ISO equivalents, words without effect, and what is refused.

After the *NC Programming Manual* of SINUMERIK 840D sl (Siemens 6FC5398-2BP40-3BA1), tables of G commands and
statements. A word in no table is refused: it may be a subprogram or a cycle of the machine builder.
"""

from __future__ import annotations

from fiveaxis.nc.languages.block import IS_CYCLE, IS_JUMP, reasons

# G commands with an equivalent in ISO 6983.
SAME_IN_ISO = {
    **{n: f"G{n}" for n in (0, 1, 2, 3, 4, 17, 18, 19, 40, 41, 42, 54, 55, 56, 57, 90, 91, 93, 94, 95)},
    **dict.fromkeys((70, 700), "G20"),
    **dict.fromkeys((71, 710), "G21"),
    97: "G95",
    971: "G94",
}

# G53, G153 and SUPA suppress all frames for one block: machine coordinates.
MACHINE_COORDINATES = (53, 153)

# G commands without effect on the path: corners, exact stop, approach with radius compensation off.
IGNORED_G = frozenset(
    (9, 60, 62, 64, 290, 601, 602, 603, 621, 641, 642, 643, 644, 645, 646, 140, 141, 142, 143)
) | frozenset((340, 341, 450, 451, 460, 461, 462))

REFUSED_G = {
    **dict.fromkeys((33, 34, 35, 63, 331, 332), "cuts a thread, whose feed isn't supported"),
    **dict.fromkeys((58, 59), "shifts the coordinates; write TRANS or ATRANS"),
    **dict.fromkeys((110, 111, 112), "sets a pole; polar coordinates aren't supported"),
    **dict.fromkeys((96, 961, 962, 973), "makes the spindle speed depend on X, which isn't supported"),
    **dict.fromkeys((147, 148, 247, 248, 347, 348), "is a soft approach, whose moves the control generates"),
    291: "switches to the ISO dialect; post the program in one language",
}

_IGNORED = """
ORIWKS ORIMKS ORIAXES ORIVECT ORIPLANE ORIEULER ORIRPY ORIRPY2 ORIVIRT1 ORIVIRT2 ORISON ORISOF ORIS ORIC
ORID ORICONTO ORIPATH ORIPATHS COMPON COMPOF COMPCAD COMPCURV COMPSURF COMPPATH UPATH SPATH CPRECON
CPRECOF SOFT BRISK DRIVE SOFTA BRISKA DRIVEA JERKLIM JERKLIMA VELOLIM VELOLIMA ACCLIMA FFWON FFWOF
DYNNORM DYNPOS DYNROUGH DYNSEMIFIN DYNFINISH DYNPREC FNORM FLIN FCUB FPO CFC CFTCP CFIN FGROUP FGREF
FENDNORM FTOCON FTOCOF CDON CDOF CDOF2 CUT2D CUT2DF CUT2DD CUT2DFD CUT3DC CUT3DF CUT3DFF CUT3DFS CUT3DCC
CUT3DCCD CUT3DCD CUTCONOF CUTMOD NORM KONT KONTC KONTT STOPRE MSG DISPLAY GROUP_BEGIN GROUP_END
GROUP_ADDEND WORKPIECE SETMS SPCON SPCOF SPOS SPOSA WAITS WALIMON WALIMOF STARTFIFO STOPFIFO STOPFIFOALL
FIFOCTRL SBLON SBLOF DISPLOF DISPLON ACTBLOCNO SAVE PROC EXTERN DIAMOF DIAMCYCOF TCARR TCOABS TCOFR
TOROTOF PAROTOF TOFRAMEOF TLIFT SD TMON TMOF CYCLE832 COLLPAIR GETD RELEASE GET WAITMC CLEARM SETM
LIFTFAST TOFFOF TOFFON ROTSOF GFRAME0 GWPSON GWPSOF RTLION
"""
_SETTINGS = """
ADIS ADISPOS CTOL OTOL ATOL OVR OVRRAP OVRA ACC FL FA FGREF LIMS SPOS SPOSA DL SPI VC FPR SCC
"""

# Words and functions without effect on the path; brackets after them belong to them.
IGNORED = frozenset(_IGNORED.split())

# The same before ``=``, with or without an index.
IGNORED_SETTINGS = frozenset(_SETTINGS.split())

_TURN = "rotates the coordinates, which isn't supported; write ROT, AROT or CYCLE800"
_KINEMATICS = "is an unsupported transformation; write TRAORI"
_POLAR = "is a polar coordinate or an angle, which isn't supported; write X, Y and Z"
_EXTRA = "adds a chamfer or a rounding, which isn't supported; post its moves"
_CURVE = "is a curve, which isn't supported; post G1, G2 and G3"
_SIDE = "moves axes independently of the path, which isn't supported; write G0 or G1"
_ANGLES = "gives the tool direction by angles whose meaning depends on machine data; write A3, B3, C3"

# The first pattern that matches a whole name gives the reason.
REFUSED = reasons(
    (r"CYCLE[0-9]+|POCKET[0-9]*|SLOT[0-9]|HOLES[0-9]|LONGHOLE", IS_CYCLE),
    (r"IF|ELSE|ENDIF|GOTO[BFCS]?|WHILE|ENDWHILE|FOR|ENDFOR|LOOP|ENDLOOP|REPEATB?|UNTIL|CASE", IS_JUMP),
    (r"P?CALL|EXTCALL|ISOCALL|SPRINT|INIT|START|REPOS[A-Z]*", IS_JUMP),
    (r"A?ROTS|CROTS?|TO(ROT|FRAME)[XYZ]?|PAROT", _TURN),
    (r"A?SCALE|A?MIRROR", "scales or mirrors the coordinates, which isn't supported; post without it"),
    (r"TRANSMIT|TRACYL|TRAANG|TRACON|TRAFOON|TRAORI_.*", _KINEMATICS),
    (r"AP|RP|ANG[12]?|AR", _POLAR),
    (r"CHF|CHR|RNDM?", _EXTRA),
    (r"[ABC]SPLINE|POLY|CIP|CT|INVCW|INVCCW|PO|PL|[IJK]1", _CURVE),
    (r"POSA?|POSP|FXS|MEAS?|MEAW|MOV|OSCILL|PUNCH.*", _SIDE),
    (r"[ABC][267]|THETA|LEAD|TILT|PSI|NUT|ORIRESET|ORICON[A-Z]*|ORICURVE|[XYZ]H", _ANGLES),
    (r"OFFN|TOFFL|TOFFR|TOFF", "offsets the tool from its path, which isn't supported; post without it"),
    (r"FB|FZ|FRC|FRCM|FD", "is a feed per block or per tooth, which isn't supported; write F"),
    (r"DIAMON|DIAM90", "makes X a diameter, as on lathes; post for a mill"),
    (r"\$.*", "is a system variable, whose effect is unknown; remove it"),
)


def refusal(name: str) -> str:
    """Return the reason why a name is refused."""
    for pattern, reason in REFUSED:
        if pattern.fullmatch(name):
            return f"{name} {reason}"
    return (
        f"{name} isn't a supported word, and may be a subprogram or an axis; post one program with all moves"
    )
