"""fiveaxis: choose the tool posture of a 5-axis path that costs the machine the least energy.

    >>> import fiveaxis as fx
    >>> machine = fx.load_machine("hayashi-640123")
    >>> tool = fx.Tool.ball(10)
    >>> toolpath = fx.plan_contour("part.stl", tool, stepdown=1.0)
    >>> solution = fx.optimise(toolpath, machine, tilt=(15, 75), part="part.stl")
    >>> report = solution.write("part.ngc", control="linuxcnc")

Many jobs, each from a file, run in parallel; finished jobs aren't run again:

    >>> batch = fx.run_batch(["cup.toml", "vase.toml"], "out")

Modules are loaded when they are used, so importing the package is quick.
"""

from typing import Any

import lazy_loader

_public, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("fiveaxis")
    return _public(name)
