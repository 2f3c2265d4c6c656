"""Every reader of the package, with inputs that it accepts."""

import gzip
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

from fiveaxis.base import ReadLog
from fiveaxis.base.errors import InputError, JobError, ToolpathError
from fiveaxis.base.findings import has_errors
from fiveaxis.base.settings import read_document
from fiveaxis.cam import load_mesh, require_solid
from fiveaxis.cam.mesh.cad.loading import load_model
from fiveaxis.cli.commands import app
from fiveaxis.cli.path_verbs import choose_search
from fiveaxis.cli.terminal import parse_numbers, parse_positions
from fiveaxis.job import make_job, read_fixtures, read_job
from fiveaxis.job.batch.ledger import read_rows
from fiveaxis.job.batch.tasks import apply_values, read_sweep
from fiveaxis.lab.calibration.log_columns import LogColumns
from fiveaxis.lab.calibration.motion_log import read_axis_log, require_motion
from fiveaxis.model import Machine, Tool, check_machine, check_text, draft_machine, load_machine, parse_tool
from fiveaxis.model.machine.answers import BY_NAME
from fiveaxis.nc import find_dialect, read_program, read_toolpath
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source
from fuzzing import seeds
from fuzzing.mutations import Seeds

BALL = Tool.ball(8)
ISO = ("fanuc*", "haas*", "linuxcnc_*", "linuxcnc-*", "toolpaths/*.nc", "toolpaths/*.ngc")


@dataclass(frozen=True)
class Reader:
    """A reader.

    Parameters
    ----------
    name : for the table
    seeds : inputs that it accepts
    read : of the input's bytes, a folder to write them to, and random choices; raises what the reader raises
    share : of the inputs that it is given, as the work after reading takes longer
    """

    name: str
    seeds: Seeds
    read: Callable[[bytes, Path, random.Random], object]
    share: float = 1.0


def _file(suffix: str, read: Callable[[Path, random.Random], object]) -> Callable[..., object]:
    def read_content(content: bytes, folder: Path, rng: random.Random) -> object:
        path = folder / f"input{suffix}"
        path.write_bytes(content)
        return read(path, rng)

    return read_content


def _text(read: Callable[[str], object]) -> Callable[..., object]:
    return lambda content, _folder, _rng: read(content.decode("utf-8", errors="replace"))


def _program(suffix: str, *machines: str) -> Callable[..., object]:
    def read(path: Path, rng: random.Random) -> None:
        machine = _known(rng.choice(machines))
        try:
            if rng.random() < 0.5:
                motion = read_program(path, machine, rapid=1000.0, block_delete=rng.random() < 0.5)
                assert np.isfinite(motion.positions).all()
                assert (motion.time >= 0.0).all()
                assert (motion.feed > 0.0).all()
            else:
                toolpath = read_toolpath(path, tool=BALL, machine=machine if rng.random() < 0.7 else None)
                assert np.isfinite(toolpath.pivot).all()
                assert (toolpath.feed > 0.0).all()
                assert (toolpath.source >= 1).all()
        except ToolpathError as fault:
            if str(path) not in str(fault):
                raise AssertionError("a message that doesn't name its file") from fault
            raise

    return _file(suffix, read)


def _locations(path: Path, rng: random.Random) -> None:
    columns = ("x", "y", "z", "i", "j", "k") if path.suffix == ".txt" else None
    toolpath = read_toolpath(path, tool=BALL if rng.random() < 0.8 else None, columns=columns)
    assert np.isfinite(toolpath.pivot).all()
    assert (toolpath.feed > 0.0).all()


def _packed(content: bytes, folder: Path, rng: random.Random) -> None:
    whole = content if content[:2] == b"\x1f\x8b" else gzip.compress(content, 1)
    _file(".csv.gz", _locations)(whole, folder, rng)


def _motion(path: Path, _rng: random.Random) -> None:
    motion = read_motion(load_source(path), _known("hayashi-640123"), source_is_table=True)
    assert np.isfinite(motion.positions).all()


@cache
def _known(machine: str) -> Machine:
    return load_machine(machine)


def _machine(path: Path, rng: random.Random) -> object:
    return check_machine(path) if rng.random() < 0.2 else load_machine(path)


def _job(path: Path, _rng: random.Random) -> object:
    for name in ("part.stl", "stock.stl", "path.csv"):
        (path.parent / name).touch()
    return read_job(path)


def _sweep(path: Path, _rng: random.Random) -> None:
    text, data = read_document(path, JobError)
    for values in list(read_sweep(data, text, path).values())[:3]:
        apply_values(values, data)


def _fixtures(path: Path, _rng: random.Random) -> None:
    (path.parent / "vice.stl").touch()
    for table in read_fixtures(path)["fixture"] or ():
        table.build()


def _log(path: Path, rng: random.Random) -> object:
    rotary = rng.random() < 0.5
    length = "deg" if rotary else "mm"
    units = {"velocity": f"{length}/s", "acceleration": f"{length}/s2", "position": length, "time": "s"}
    given: dict[str, Any] = {}
    for (quantity, unit), name in zip(units.items(), ("v", "a", "x", "t"), strict=True):
        if rng.random() < 0.5:
            given |= {quantity: name, f"{quantity}_unit": unit}
    if "time" in given and rng.random() < 0.2:
        given["time_unit"] = "iso"
    if "time" not in given and rng.random() < 0.7:
        given["rate"] = 10.0
    columns = LogColumns.of("p", rng.choice(["W", "%"]), ReadLog(**given), rotary=rotary)
    log = read_axis_log(path, columns)
    require_motion(log, columns)
    return log


def _mesh(path: Path, rng: random.Random) -> None:
    mesh = load_mesh(path, allow_open=rng.random() < 0.7)
    require_solid(mesh, "mesh")
    assert np.isfinite(mesh.area)


def _cad(path: Path, _rng: random.Random) -> None:
    model = load_model(path, seconds=8.0)
    assert np.isfinite(model.corners).all()
    assert np.isfinite(model.deviation)


def _verb(suffix: str, *words: str) -> Callable[..., object]:
    """Make the whole command of a verb a reader: it is refused where its exit code is that of wrong input."""

    def read(path: Path, _rng: random.Random) -> None:
        verb, *options = (word.format(out=path.with_name("out")) for word in words)
        ended = CliRunner().invoke(app, [verb, str(path), *options])
        if ended.exception is not None and not isinstance(ended.exception, SystemExit):
            raise ended.exception
        assert "Traceback" not in ended.output
        if ended.exit_code == InputError.exit_code:
            raise InputError(ended.stderr)

    return _file(suffix, read)


def _answers(text: str) -> None:
    parts = [line.partition("=")[::2] for line in text.splitlines()]
    known = {(name, answer[:1].strip()): answer[1:] for name, answer in parts if name in BY_NAME}
    draft = draft_machine(known)
    assert not has_errors(check_text(draft.text, Path("machine.toml")))


def _option(text: str) -> None:
    kind, _, value = text.partition(" ")
    if kind == "setup":
        choose_search(make_job(input="part.csv"), value)
    elif kind == "numbers":
        parse_numbers(value, 3, "X,Y,Z")
    else:
        parse_positions("--start", value)


HAYASHI, TRUNNION = ("-m", "hayashi-640123"), ("-m", "linuxcnc-xyzac-trt", "--rapid", "1000")
CUTTER = ("--tool", "ball:8")
LOG = ("--power", "p", "--velocity", "v", "--acceleration", "a", "--time", "t")
UNITS = ("--power-unit", "W", "--velocity-unit", "mm/s", "--acceleration-unit", "mm/s2", "--time-unit", "s")


def readers() -> list[Reader]:
    """List every reader, and the verbs that read."""
    return [*_programs(), *_settings(), *_tables(), *_meshes(), *_verbs()]


def _programs() -> Iterator[Reader]:
    iso = Seeds((seeds.ISO, *seeds.parts(*ISO)), seeds.BLOCKS + seeds.ISO_WORDS)
    texts = (seeds.KLARTEXT, *seeds.parts("heidenhain*"))
    klartext = Seeds(texts, seeds.BLOCKS + seeds.KLARTEXT_WORDS)
    texts = (seeds.SINUMERIK, *seeds.parts("sinumerik*", "toolpaths/*.mpf"))
    sinumerik = Seeds(texts, seeds.BLOCKS + seeds.SINUMERIK_WORDS)
    millplus = Seeds((*seeds.MILLPLUS, *seeds.parts("toolpaths/*millplus*")), seeds.BLOCKS)
    yield Reader("ISO program", iso, _program(".nc", "linuxcnc-xyzac-trt", "variaxis-630", "umc-750"))
    yield Reader("Klartext", klartext, _program(".h", "dmu50ev"))
    yield Reader("Sinumerik", sinumerik, _program(".mpf", "dmu80p-duoblock"))
    yield Reader("MillPlus", millplus, _program(".nc", "dmu50ev"))


def _tables() -> Iterator[Reader]:
    apt = seeds.parts("apt_*", "toolpaths/*.cls", "toolpaths/*.apt", "toolpaths/*.cls.gz")
    points = (*seeds.POINTS, *seeds.parts("points*", "cases/*.csv"))
    packed = tuple(gzip.compress(text) for text in seeds.POINTS)
    waypoints = (seeds.WAYPOINTS, *seeds.parts("toolpaths/*.txt"))
    yield Reader("APT", Seeds(apt), _file(".apt", _locations))
    yield Reader("points .csv", Seeds(points), _file(".csv", _locations))
    yield Reader("points .txt", Seeds(waypoints), _file(".txt", _locations))
    yield Reader("points .csv.gz", Seeds((*packed, *points)), _packed)
    yield Reader("motion.csv", Seeds(seeds.parts("motion_hayashi*")), _file(".csv", _motion))
    yield Reader("power log", Seeds(seeds.LOGS), _file(".csv", _log))
    yield Reader("results.jsonl", Seeds((seeds.RESULTS,)), _file(".jsonl", lambda path, _: read_rows(path)))


def _settings() -> Iterator[Reader]:
    machines = Seeds(seeds.texts_in("machines", "umc-750", "hayashi-640123"))
    controls = Seeds(seeds.texts_in("fiveaxis/nc/controls", "points", "haas"))
    yield Reader("machine .toml", machines, _file(".toml", _machine))
    yield Reader(
        "machine .ini", Seeds((seeds.INI, *seeds.parts("machines/*.ini", head=400))), _file(".ini", _machine)
    )
    urdf = Seeds(tuple(_known(name).to_urdf("bed").encode() for name in ("hayashi-640123", "dmu50ev")))
    yield Reader("machine .urdf", urdf, _file(".urdf", _machine))
    yield Reader("machine .mch", Seeds(seeds.VERICUT), _file(".mch", _machine))
    yield Reader("answers", Seeds(seeds.ANSWERS), _text(_answers))
    yield Reader("job .toml", Seeds((*seeds.JOBS, seeds.STARTER)), _file(".toml", _job))
    yield Reader("sweep .toml", Seeds(seeds.SWEEPS), _file(".toml", _sweep))
    yield Reader("fixtures .toml", Seeds(seeds.FIXTURES), _file(".toml", _fixtures))
    yield Reader(
        "tool .toml", Seeds((seeds.TOOL_FILE,)), _file(".toml", lambda path, _: parse_tool(str(path)))
    )
    yield Reader("control .toml", controls, _file(".toml", lambda path, _: find_dialect(path)))
    yield Reader("tool", Seeds(seeds.TOOLS), _text(parse_tool))
    yield Reader("options", Seeds(seeds.OPTIONS), _text(_option))
    yield Reader("code", Seeds(seeds.CODES), _text(Machine.from_code))


def _meshes() -> Iterator[Reader]:
    yield Reader("STL, binary", Seeds(seeds.meshes("stl"), binary=True), _file(".stl", _mesh))
    yield Reader("STL, text", Seeds(seeds.meshes("stl_ascii")), _file(".stl", _mesh))
    yield Reader("PLY, binary", Seeds(seeds.meshes("ply"), binary=True), _file(".ply", _mesh))
    yield Reader("PLY, text", Seeds(seeds.meshes("ply", encoding="ascii")), _file(".ply", _mesh))
    yield Reader("OBJ", Seeds(seeds.meshes("obj"), seeds.OBJ_WORDS), _file(".obj", _mesh))
    yield Reader("OFF", Seeds(seeds.meshes("off")), _file(".off", _mesh))
    if find_spec("OCP") is not None:
        # Each is read in a process of its own, which takes a second.
        yield Reader("STEP", Seeds(seeds.CAD), _file(".step", _cad), 0.002)


def _verbs() -> Iterator[Reader]:
    iso = Seeds(seeds.parts(*ISO), seeds.BLOCKS)
    motions, logs = Seeds(seeds.parts("motion_hayashi*")), Seeds(seeds.LOGS)
    machines = Seeds(seeds.texts_in("machines", "umc-750", "hayashi-640123"))
    boxes, points = Seeds(seeds.meshes("off")), Seeds(seeds.POINTS[:1])
    planning = ("--tool", "ball:0.5", "--stepdown", "0.5")
    posture = (*HAYASHI, *CUTTER, "--tilt", "5:75", "--effort", "quick")
    yield Reader("verify NC", iso, _verb(".ngc", "verify", *TRUNNION), 0.01)
    yield Reader("verify motion", motions, _verb(".csv", "verify", *HAYASHI, *CUTTER), 0.01)
    yield Reader("energy", iso, _verb(".ngc", "energy", *TRUNNION, "--drives", "hayashi-640123"), 0.01)
    yield Reader("post", motions, _verb(".csv", "post", "-c", "fanuc", "-o", "{out}.nc", *HAYASHI), 0.01)
    yield Reader("info", machines, _verb(".toml", "info"), 0.01)
    yield Reader("urdf", machines, _verb(".toml", "urdf"), 0.01)
    yield Reader("import", Seeds((seeds.INI,)), _verb(".ini", "import"), 0.01)
    yield Reader(
        "calibrate", logs, _verb(".csv", "calibrate", "--axis", "X", "--model", "affine", *LOG, *UNITS), 0.01
    )
    yield Reader("plan", boxes, _verb(".off", "plan", *planning), 0.01)
    yield Reader("optimise", points, _verb(".csv", "optimise", *posture), 0.002)
