"""The night of docs/night.md and the control program of docs/sdss-control.md, on a small array."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import UnprovenError
from fiberplan.hardware import sdss
from fiberplan.hardware.audit import audit

DOCS = Path(__file__).parents[1] / "docs"
sys.path.append(str(DOCS))

from night import MARGIN, night  # noqa: E402
from sdss_control import paths  # noqa: E402


@pytest.fixture(scope="module")
def plane():
    """Nineteen robots that are known by number, too."""
    plane = fp.FocalPlane.hexagonal(2, 22.4, max_speed=np.radians(11.7))
    return plane.replace(aliases=tuple(str(100 + i) for i in range(plane.n)))


@pytest.fixture(scope="module")
def tonight(plane, tmp_path_factory):
    folder, log = tmp_path_factory.mktemp("night"), []
    return night(plane, folder, log.append), folder, log


def test_nobody_has_to_step_in(tonight, plane):
    done, folder, log = tonight
    assert len(list(folder.glob("*.json"))) == done.moves == 7
    assert not any("CONTACT" in line for line in log)
    assert sum(line.startswith("  executed: safe") for line in log) == 7
    assert [line.partition(":")[0] for line in log if not line.startswith(" ")] == [
        *(f"field {k}" for k in range(1, 5)), "field 4 again", "field 5", "home",
    ]  # fmt: skip
    able = done.state.online
    assert (~able).sum() == 1
    home = (np.degrees(np.abs(done.state.angles - plane.folded)) < 0.05).all(axis=1)
    assert home.sum() >= plane.n - 2  # the dead robot shuts one in, which is proven
    assert ("home: 17 of 18" in "\n".join(log)) == (home.sum() == plane.n - 2)


def test_the_log_names_who_died_who_took_the_opportunity_and_what_was_cut_short(tonight):
    _, _, log = tonight
    text = "\n".join(log)
    (dead,) = re.findall(r"(\S+) does not answer: offline where it stands", text)
    assert f"lost {dead}" in text or f"lost: {dead}" in text or f"'{dead}'" in text
    assert re.search(r"opportunity at \(5\.0, 12\.0\) mm: amended: positioner '\S+' has another goal", text)
    (short,) = re.findall(r"aborted at \d+\.\d s: (\d+) robots are short of their goals", text)
    assert int(short) >= 10


def test_every_file_of_the_night_stands_an_audit(tonight, plane):
    """From the files alone: each begins where the one before left everyone, but for what robots are off by."""
    done, folder, _ = tonight
    for file in sorted(folder.glob("*.json")):
        found = audit(done.plane, file, margin=0.0)
        assert found.certificate.contacts == (), file
    sent = json.loads((folder / "trajectory-0007.json").read_text())["trajectory"]
    assert len(sent) == plane.n - 1


@pytest.fixture(scope="module")
def made(plane):
    field = fp.scenes.clustered_targets(plane, seed=4, margin=MARGIN).configuration(plane)
    positions = {f"{100 + i}": tuple(np.degrees(angles)) for i, angles in enumerate(plane.folded)}
    goals = {id_: tuple(np.degrees(a)) for id_, a in zip(plane.ids, field, strict=True) if np.isfinite(a).all()}
    return paths(plane, positions, goals, offline=("104",)), goals


def test_dictionaries_in_and_trajectories_out(made, plane, tmp_path):
    result, goals = made
    there, back = result.to_destination, result.from_destination
    assert set(there) == set(back) == {f"{100 + i}" for i in range(plane.n)} - {"104"}
    for robot, goal in goals.items():
        name = plane.aliases[plane.index_of(robot)]
        if name == "104" or robot in result.lost:
            continue
        ends = [there[name][axis][-1][0] for axis in ("alpha", "beta")]
        np.testing.assert_allclose(ends, goal, atol=0.01)
        np.testing.assert_allclose([back[name][axis][0][0] for axis in ("alpha", "beta")], goal, atol=0.01)
        np.testing.assert_allclose([back[name][axis][-1][0] for axis in ("alpha", "beta")], [0.0, 180.0], atol=0.01)
        assert there[name]["alpha"][0][1] == 1.0
    for name, trajectory in (("there.json", there), ("back.json", back)):
        (tmp_path / name).write_text(json.dumps(trajectory))
        assert not audit(plane, tmp_path / name, margin=MARGIN - 0.05).certificate.contacts
    assert result.did_fail == bool(result.lost)
    assert plane.ids[4] in result.lost or plane.ids[4] not in goals


def test_no_dictionary_of_what_is_not_proven(made, monkeypatch):
    """The bytes that are proven are those that are handed over: two robots exchanged are found."""
    right = sdss.as_json

    def exchanged(sent):
        return right([sent[0]._replace(robot=sent[1].robot), sent[1]._replace(robot=sent[0].robot), *sent[2:]])

    monkeypatch.setattr(sdss, "as_json", exchanged)
    with pytest.raises(UnprovenError, match="would end"):
        sdss.trajectory(made[0].plan)
