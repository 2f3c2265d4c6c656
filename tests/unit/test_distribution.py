"""What is handed out: the conda recipe asks for what the package asks for."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# What conda-forge calls packages that have another name on PyPI.
ON_CONDA = {"pin": "pinocchio", "meshcat": "meshcat-python"}


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def recipe():
    return (ROOT / "docs/conda/recipe.yaml").read_text()


def listed(recipe: str, section: str) -> set[str]:
    """Give the entries of a list in the recipe, in YAML that has one entry a line."""
    [block] = re.findall(rf"^ *{section}:\n((?: +(?:- |#).*\n)+)", recipe, re.MULTILINE)
    return set(re.findall(r"- (.+)", block))


def asked_of_conda(requirement: str) -> str:
    name, version = re.fullmatch(r"([\w-]+)(>=[\d.]+)(?:;.*)?", requirement).groups()
    return f"{ON_CONDA.get(name, name)} {version}"


def test_the_recipe_asks_for_the_packages_of_pyproject(project, recipe):
    wanted = {asked_of_conda(one) for one in project["dependencies"]}
    assert listed(recipe, "run") - {"python >=${{ python_min }}"} == wanted


def test_the_recipe_has_version_python_and_optional_packages_of_pyproject(project, recipe):
    assert f'version: "{project["version"]}"' in recipe
    assert f'python_min: "{project["requires-python"].removeprefix(">=")}"' in recipe
    extras = project["optional-dependencies"]
    extra = {asked_of_conda(one) for one in (*extras["cluster"], *extras["notebook"])}
    assert listed(recipe, "run_constraints") == extra
