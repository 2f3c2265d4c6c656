"""The first run on a computer says what it is doing."""

from types import SimpleNamespace

from rich.console import Console

from fiveaxis.cli.first_run import NOTE, tell_first_run
from fiveaxis.posture.search.kernel import relax_layer


def test_it_is_said_until_something_compiled_is_kept(tmp_path, capsys):
    kernel = SimpleNamespace(py_func=relax_layer.py_func, stats=SimpleNamespace(cache_path=str(tmp_path)))
    console = Console(soft_wrap=True)
    tell_first_run(kernel, console)
    assert capsys.readouterr().out.strip() == NOTE
    (tmp_path / "kernel.relax_layer-59.py311.nbi").touch()
    tell_first_run(kernel, console)
    assert capsys.readouterr().out == ""


def test_a_real_kernel_tells_where_it_is_kept():
    assert relax_layer.stats.cache_path is not None
