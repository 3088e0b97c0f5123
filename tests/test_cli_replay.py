"""``fiberplan replay``: exit codes, one line for what is wrong, and what it says."""

import json
import sys

import pytest

from fiberplan.cli.app import run
from fiberplan.plan import Plan
from fuzz.made_false import base, sealed
from replayed import FILES

pytestmark = pytest.mark.small


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """plan.fits holds; false.fits lacks a row; none.fits has no axes."""
    folder = tmp_path_factory.mktemp("replay")
    columns, claims = base(FILES["three"])
    tables = dict(claims.tables)
    (folder / "plan.fits").write_bytes(sealed(columns, tables))
    (folder / "false.fits").write_bytes(
        sealed(columns, tables | {"CERTIFICATE_AXES": tables["CERTIFICATE_AXES"][1:].copy()})
    )
    Plan.read(folder / "plan.fits").write(folder / "none.fits", certificate=False)
    (folder / "damaged.fits").write_bytes((folder / "plan.fits").read_bytes()[:-2880])
    return folder


@pytest.fixture(autouse=True)
def here(folder, monkeypatch):
    monkeypatch.chdir(folder)


def test_every_claim_holds(capsys):
    assert run(["replay", "plan.fits"]) == 0
    out = capsys.readouterr().out
    assert "every claim holds" in out
    assert "hexagonal: 3 positioners" in out
    assert "meets arm" in out


def test_what_does_not_hold_is_named(capsys):
    assert run(["replay", "false.fits", "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert not answer["ok"]
    assert "0 rows speak" in answer["faults"][0]
    assert run(["replay", "false.fits"]) == 1
    assert "1 claims are not shown" in capsys.readouterr().out


def test_axes_are_made_where_a_file_has_none(capsys):
    assert run(["replay", "none.fits"]) == 0
    assert "they were made first" in capsys.readouterr().out


def test_since(capsys):
    assert run(["replay", "plan.fits", "--since", "plan.fits", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["judged"] == 0
    assert answer["taken"] > 0


@pytest.mark.parametrize("file", ["damaged.fits", "missing.fits"])
def test_bad_files_are_refused_in_one_line(file, capsys):
    for arguments in ([file], ["plan.fits", "--since", file]):
        assert run(["replay", *arguments]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert file in said.err
        assert said.err.count("\n") == 1


def test_without_flint(capsys, monkeypatch):
    for name in [name for name in sys.modules if "replay" in name and name.startswith("fiberplan.certificates")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "flint", None)
    assert run(["replay", "plan.fits"]) == 2
    assert "pip install 'fiberplan[proof]'" in capsys.readouterr().err
