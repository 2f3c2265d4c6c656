"""Objects say in a line what they are: in a notebook and in a debugger nobody reads arrays."""

import numpy as np
import pytest

import fiveaxis as fx

LONGEST = 240


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(200, -0.2)])
    path = fx.Toolpath.from_contacts(20.0 * normal, normal, fx.Tool.ball(8), name="ring.csv")
    machine = fx.load_machine("hayashi-640123")
    solution = fx.optimise(path, machine, tilt=(15, 75), effort="quick")
    made = solution.program()
    file = made.write(tmp_path_factory.mktemp("reprs") / "ring.ngc")
    grid = (np.linspace(-1.0, 1.0, 9), np.linspace(-1.0, 1.0, 5))
    return {
        "Machine": machine,
        "Axis": machine.axis("Z"),
        "Chain": machine.chain,
        "Toolpath": path,
        "Tool": path.tool,
        "Solution": solution,
        "Motion": solution.motion,
        "Energy": solution.energy,
        "Baseline": next(iter(solution.compared.values())),
        "TiltBounds": solution.tilt,
        "MadeProgram": made,
        "Program": made.text,
        "ProgramMotion": made.motion,
        "Report": made.report,
        "ProgramSettings": fx.ProgramSettings(),
        "ReadMotion": fx.read_program(file, machine),
        "ProgramEnergy": fx.program_energy(file, machine),
        "PowerSurface": fx.power_surface(machine, (0.0, 0.0, 0.0), 1000.0, grid),
    }


def test_every_object_is_a_line(objects):
    for name, thing in objects.items():
        assert type(thing).__name__ == name
        text = repr(thing)
        assert len(text) <= LONGEST, text
        assert "\n" not in text
        assert name in text


def test_what_is_said_is_so(objects):
    assert "640123" in repr(objects["Machine"])
    assert "200 locations" in repr(objects["Toolpath"])
    assert f"{objects['Solution'].energy.total:.0f} J" in repr(objects["Solution"])
    assert "no errors" in repr(objects["Report"])
