"""Wheel and source archive, built and installed as a user would, away from the clone."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.slow

USE = """
import fiberplan as fp
from fiberplan.instruments import names
from pathlib import Path

home = Path(fp.__file__).parent
assert home.is_relative_to(FOLDER), home
assert "sdss" in names() and all(fp.FocalPlane.load(name).n for name in names())
assert (home / "py.typed").is_file()
assert (home / "visuals" / "assets" / "page.html").is_file()
print(fp.__version__)
"""


def run(*command, cwd, **environment):
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    quiet = {"PYTHONDONTWRITEBYTECODE": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INDEX": "1"}
    done = subprocess.run(
        [sys.executable, *map(str, command)], cwd=cwd, env=kept | quiet | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def distributions(tmp_path_factory):
    """Folder with the wheel and the source archive."""
    folder = tmp_path_factory.mktemp("dist")
    run("-m", "hatchling", "build", "--directory", folder, cwd=ROOT)
    assert len(list(folder.iterdir())) == 2
    return folder


def files_of(archive):
    """Names in an archive, below its top folder if it is a source archive."""
    if archive.suffix == ".whl":
        return {entry.filename for entry in zipfile.ZipFile(archive).infolist() if not entry.is_dir()}
    with tarfile.open(archive) as tar:
        return {member.name.split("/", 1)[1] for member in tar.getmembers() if member.isfile()}


def tracked(folder):
    """Files of a folder that belong to the project: neither caches nor what is built."""
    made = {"__pycache__", "_build", "_examples"}
    paths = [p for p in (ROOT / folder).rglob("*") if p.is_file() and not made & {*p.parts}]
    return {str(p.relative_to(ROOT)) for p in paths if p.suffix not in {".nbi", ".nbc", ".pyc"}}


def test_wheel_holds_the_package_and_nothing_else(distributions):
    (wheel,) = distributions.glob("*.whl")
    files = files_of(wheel)
    package = {name for name in files if ".dist-info/" not in name}
    assert package == {name.removeprefix("src/") for name in tracked("src")}
    assert {"fiberplan/py.typed", "fiberplan/instruments/builtin/sdss.toml"} <= package
    assert any(name.endswith("licenses/LICENSE") for name in files)


def test_source_archive_holds_what_a_developer_needs(distributions):
    (archive,) = distributions.glob("*.tar.gz")
    files = files_of(archive)
    wanted = set().union(*(tracked(folder) for folder in ("src", "tests", "benchmarks", "docs", "design")))
    assert wanted <= files
    assert {"CONTRIBUTING.md", "SECURITY.md", "Makefile", "pyproject.toml", "README.md", "LICENSE"} <= files
    assert not [name for name in files if name.endswith((".nbi", ".nbc", ".pyc")) or "__pycache__" in name]


@pytest.mark.parametrize("pattern", ["*.whl", "*.tar.gz"])
def test_installed_elsewhere_it_works(distributions, tmp_path, pattern):
    (archive,) = distributions.glob(pattern)
    place = tmp_path / "site"
    run(
        "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--target", place, archive, cwd=tmp_path
    )
    code = f"FOLDER = {str(place)!r}\n{USE}"
    environment = {"PYTHONPATH": str(place), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert run("-c", code, cwd=tmp_path, **environment).strip() in archive.name
    said = run("-m", "fiberplan", "instruments", cwd=tmp_path, **environment)
    assert "sayres2021" in said
