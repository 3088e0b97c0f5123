"""Past failures stay mended; what the fuzzer finds joins them; scenes are written as they are."""

import json

import numpy as np
import pytest

from fuzz import __main__ as fuzz
from fuzz.corpus import FOLDER, ask, keep
from fuzz.planted import twos
from fuzz.stated import motion_of, plane_of, stated
from references import clearance_over_time, looks

FILES = sorted(FOLDER.glob("*.json"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_past_failure_stays_mended(path, tmp_path):
    ask(path, tmp_path)


def test_another_answer_is_noticed(tmp_path):
    for path in FILES:
        said = json.loads(path.read_text())
        if "touch" in said:
            wrong = tmp_path / path.name
            wrong.write_text(json.dumps(said | {"touch": not said["touch"]}))
            with pytest.raises(AssertionError, match="touch is"):
                ask(wrong, tmp_path)


def test_what_the_fuzzer_finds_is_kept_and_asked_again(tmp_path, monkeypatch, capsys):
    def unlucky(rng, folder):
        if rng.integers(10) == 4:
            raise AssertionError("an unlucky number\nof ten")

    monkeypatch.setitem(fuzz.CAMPAIGNS, "unlucky", unlucky)
    assert fuzz.main(["--only", "unlucky", "--count", "3", "--keep", str(tmp_path)]) == 1
    (path,) = tmp_path.glob("*.json")
    assert path.name in capsys.readouterr().out
    assert json.loads(path.read_text()) == {
        "why": "AssertionError: an unlucky number",
        "campaign": "unlucky",
        "seed": 1,
    }
    with pytest.raises(AssertionError, match="unlucky number"):
        ask(path, tmp_path)
    ask(keep(tmp_path, "unlucky", 2, "nothing"), tmp_path)


def test_scenes_are_written_as_they_are():
    plane, motion, made = twos(np.random.default_rng(0), 6)
    assert not plane.kinematics.has_avoidance
    assert len(made) > 2
    for i, arm in made:
        arms = json.loads(json.dumps([stated(plane, motion, k) for k in (i, arm)]))
        again, moved = plane_of(arms), motion_of(arms)
        times = looks(motion, i, arm, 50)
        expected = clearance_over_time(plane, motion, i, arm, times)
        assert np.allclose(clearance_over_time(again, moved, 0, 1, times), expected, atol=1e-9)
        assert again.online[0] == plane.online[i]
