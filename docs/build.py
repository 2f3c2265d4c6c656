"""Build the documentation: `python -W error docs/build.py out/docs`.

The pages of `docs/pages`, the tables of keys (`formats.py`) and of papers (`papers.py`), the reference
(`reference.py`) and the figures (`figures.py`) are gathered in a temporary folder, and Sphinx makes the site
of them there. A warning of Sphinx is an error.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import warnings
from pathlib import Path

import figures
import formats
import papers
import reference
from sphinx.cmd.build import build_main

HERE = Path(__file__).parent


def gather(folder: Path) -> None:
    """Write all that the site is made of into a folder."""
    shutil.copytree(HERE / "pages", folder, dirs_exist_ok=True)
    shutil.copy(HERE / "conf.py", folder)
    for name, text in (formats.pages() | papers.pages()).items():
        _write(folder / "_generated" / f"{name}.md", text)
    for name, text in reference.pages().items():
        _write(folder / "reference" / name, text)
    figures.draw_all(folder / "figures")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def build(folder: Path) -> int:
    """Build the site into a folder; give the exit code of Sphinx."""
    with tempfile.TemporaryDirectory(prefix="fiveaxis-docs-") as gathered:
        # As deep as in the repository, for the programs that pages include.
        source = Path(gathered, "docs", "pages")
        for folder_of_programs in ("tests/golden", "examples"):
            shutil.copytree(HERE.parent / folder_of_programs, Path(gathered, folder_of_programs))
        gather(source)
        doctrees = str(Path(gathered, "doctrees"))
        options = ["-b", "html", "-W", "--keep-going", "-q", "-d", doctrees]
        # What a coming Sphinx takes away concerns the theme and the extensions, not these pages.
        warnings.simplefilter("ignore", PendingDeprecationWarning)
        return build_main([*options, str(source), str(folder)])


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1] if len(sys.argv) > 1 else "out/docs")))
