"""``fiberplan survey``: what it says, and what it refuses before anything is written."""

import json

import pytest

from fiberplan.cli.app import run
from problems import ARM, SEVEN_PLACES

pytestmark = pytest.mark.small
TELESCOPE = 'format = 1\nname = "toy"\nscale = [34.9]\nradius = 1.15\n'


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "seven.toml").write_text('format = 1\nname = "seven"\nmargin = 0.5\n' + SEVEN_PLACES + ARM)
    (tmp_path / "toy.toml").write_text(TELESCOPE)
    (tmp_path / "all.csv").write_text("id,field,x,y,category\na,1,9,8,star\nb,1,12,-8,star\nb,2,9,8,star\n")
    (tmp_path / "fields.csv").write_text("id\n1\n2\n")
    return tmp_path


@pytest.mark.large
def test_survey_of_a_made_up_sky(files, capsys):
    words = ["survey", "seven.toml", "--demo", "2", "--telescope", "toy.toml", "--at-once", "1", "-o", "out"]
    assert run([*words, "--require", "sky=1"]) == 0
    said = capsys.readouterr().out
    assert "2 of 2 fields planned and proven" in said
    assert "note: sky to focal plane by a radial plate scale" in said
    assert run([*words, "--require", "sky=1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["failed"] == {}
    assert told["observations"] == 3
    assert run(words) == 2
    assert "ledger.jsonl: is of another choice of settings" in capsys.readouterr().err


def test_survey_of_places_that_are_known(files, capsys):
    assert run(["survey", "seven.toml", "all.csv", "fields.csv", "--at-once", "1", "-o", "out", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["observations"], told["fields"]) == (2, 2)
    assert told["completeness"][0]["complete"] == 2
    assert run(["survey", "seven.toml", "all.csv", "fields.csv", "-o", "out"]) == 0
    assert "note: each field waits for the one before" in capsys.readouterr().out
    assert not (files / "out" / "plans" / "000001.fits").exists()  # b has been observed, and nothing is left for 2


@pytest.mark.large
def test_priority_one_is_first_where_that_is_said(files, capsys):
    (files / "two.csv").write_text("id,field,x,y,priority\nlast,1,9,8,2\nfirst,1,8,9,1\n")
    (files / "one.csv").write_text("id\n1\n")
    for order, id_ in (("larger", "last"), ("smaller", "first")):
        assert run(["survey", "seven.toml", "two.csv", "one.csv", "--priority-order", order, "-o", order]) == 0
        assert f" {id_} 1 science" in (files / order / "targets" / "000000.ecsv").read_text()
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["all.csv"], "name CATALOGUE and FIELDS, or --demo N"),
        (["all.csv", "fields.csv", "--demo", "2"], "--demo 2 makes its sky up, and all.csv is a file"),
        (["--demo", "2"], "--demo needs a telescope for seven"),
        (["--demo", "2", "--telescope", "keck"], "there is no telescope 'keck'"),
        (["all.csv", "fields.csv", "--require", "sky"], "--require sky: expected CATEGORY=N"),
        (["all.csv", "fields.csv", "--scheduler", "tcp://x:1"], "--scheduler tcp://x:1: needs --executor dask"),
        (["all.csv", "none.csv"], "none.csv: no such file"),
        (["fields.csv", "fields.csv"], "fields.csv: no column 'x'"),
    ],
)
def test_what_cannot_be_is_one_line_and_nothing_is_written(files, capsys, words, complaint):
    assert run(["survey", "seven.toml", *words, "-o", "out"]) == 2
    assert complaint in capsys.readouterr().err.lower().replace(complaint.lower(), complaint)
    assert not (files / "out").exists()
