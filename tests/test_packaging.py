"""What a newcomer meets first: the README's commands and code, one version, a Makefile that keeps its word."""

import ast
import importlib
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import fiberplan

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
MAKEFILE = (ROOT / "Makefile").read_text()


def test_readme_code_runs(tmp_path, monkeypatch, capsys):
    (block,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "arrived in" in printed
    assert "safe: smallest proven clearance" in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == ["field.fits", "field.html"]


def test_readme_names_only_commands_that_exist():
    from typer.main import get_command

    from fiberplan.cli.app import app

    named = re.findall(r"(?:^|`|bin/)fiberplan\s([a-z]+)", README, flags=re.MULTILINE)
    assert {"plan"} < set(named) <= set(get_command(app).commands)  # all of them: tests/test_manual.py
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, flags=re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z-]+)\b(?=`|  )", README)) <= targets


@pytest.mark.parametrize("link", re.findall(r"\]\(((?!http)[^)]+)\)", README))
def test_readme_links_lead_somewhere(link):
    assert (ROOT / link).exists()


def test_ci_runs_what_the_readme_tells():
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    (command,) = re.findall(r"^make (.+)$", (ROOT / ".ci" / "run").read_text(), flags=re.MULTILINE)
    for target in command.split():
        assert f"make {target}" in README


def test_one_version_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == fiberplan.__version__
    assert f"version: {fiberplan.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## [{fiberplan.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def test_public_names_can_be_had():
    for name in fiberplan.__all__:
        assert getattr(fiberplan, name) is not None
    assert set(fiberplan.__all__) <= set(dir(fiberplan))
    with pytest.raises(AttributeError, match="no attribute 'Fokal'"):
        _ = fiberplan.Fokal


def test_lazy_names_are_the_declared_ones():
    (checked,) = (
        node
        for node in ast.parse((ROOT / "src" / "fiberplan" / "__init__.py").read_text()).body
        if isinstance(node, ast.If)
    )
    declared = {name.name: node.module for node in checked.body for name in node.names}
    packages = {name for name, home in declared.items() if home == "fiberplan"}
    assert packages == set(fiberplan._PACKAGES)
    assert {n: h for n, h in declared.items() if n not in packages} == {
        name: f"fiberplan.{home}" for name, home in fiberplan._HOME.items()
    }
    assert set(declared) == set(fiberplan.__all__)


def test_help_does_not_wait_for_the_compiler():
    check = "from fiberplan.cli.app import run; import sys; run(['--help']); sys.exit('numba' in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    assert subprocess.run([sys.executable, "-c", check], stdout=subprocess.DEVNULL, env=environment).returncode == 0


def test_every_module_is_imported_without_side_effects(capsys):
    for path in (ROOT / "src" / "fiberplan").rglob("*.py"):
        parts = path.relative_to(ROOT / "src").with_suffix("").parts
        if parts[-1] != "__main__":
            importlib.import_module(".".join(parts).removesuffix(".__init__"))
    assert capsys.readouterr() == ("", "")


def test_what_is_imported_is_asked_for():
    """What comes along with another package need not do so tomorrow: typer brought click, and no longer does."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"], *(line for extra in project["optional-dependencies"].values() for line in extra)]
    names = {re.match(r"[\w-]+", line)[0].lower().replace("-", "_") for line in asked}
    known = {
        "yaml": "pyyaml",
        "flint": "python_flint",
        "PIL": "matplotlib",
        "llvmlite": "numba",
        "traitlets": "anywidget",
    }
    found = set()
    for path in (ROOT / "src" / "fiberplan").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(str(node.module).partition(".")[0])
    others = found - set(sys.stdlib_module_names) - {"fiberplan"}
    assert {name for name in others if known.get(name, name) not in names} == set()
