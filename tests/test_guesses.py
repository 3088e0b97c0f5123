"""Guesses of where somebody stands: which of them a proof needs, and whom one touches that cannot be right."""

import json
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.certificates import needed_guesses
from fiberplan.cli.app import run
from fiberplan.focal_plane.bodies import Body
from fiberplan.motion import Trajectory

SEVEN = fp.FocalPlane.hexagonal(1, 22.4, max_speed=np.radians(12.0), name="seven")
LEFT, MIDDLE, RIGHT = (SEVEN.index[id_] for id_ in ("R0C1", "R0C2", "R0C3"))


def moved(*who):
    """Everyone folded but `who`, who turn a little, and can alone move."""
    online = np.zeros(SEVEN.n, bool)
    online[list(who)] = True
    end = SEVEN.folded.copy()
    end[list(who)] = np.radians([100.0, 140.0])
    return SEVEN.replace(online=online), Trajectory.from_samples(np.array([0.0, 20.0]), np.stack([SEVEN.folded, end]))


def test_a_guess_is_needed_where_somebody_comes_near():
    assert needed_guesses(*moved(LEFT), 0.8, np.array([RIGHT, MIDDLE])).tolist() == [False, True]
    assert needed_guesses(*moved(LEFT, MIDDLE), 0.8, np.array([RIGHT])).tolist() == [True]
    assert needed_guesses(*moved(LEFT), 12.0, np.array([RIGHT])).tolist() == [True]
    assert needed_guesses(*moved(LEFT), 0.8, np.array([RIGHT]), position_error=11.5).tolist() == [True]


def test_wherever_the_unknown_one_stands_a_motion_that_needs_no_guess_is_safe():
    plane, motion = moved(LEFT)
    rng = np.random.default_rng(0)
    for _ in range(20):
        angles = motion.start.copy()
        angles[RIGHT] = plane.kinematics.random(plane, rng, np.array([RIGHT]))[0]
        samples = np.stack([angles, np.where(plane.online[:, None], motion.end, angles)])
        found = fp.verify(plane, Trajectory.from_samples(np.array([0.0, 20.0]), samples), 0.8)
        assert found.ok


def test_the_command_tells_which_guesses_are_needed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    SEVEN.write("seven.fits")
    Path("one.csv").write_text("positioner,alpha,beta\nR0C1,100,140\n")
    others = [id_ for id_ in SEVEN.ids if id_ not in ("R0C1", "R0C2", "R0C3")]
    rows = "".join(f"{id_},0,180\n" for id_ in (*others, "R0C1"))
    Path("seen.csv").write_text(f"positioner,alpha,beta\n{rows}")
    options = ["--margin", "0.8", "--start", "seen.csv", "--offline", ",".join(others), "-o", "p.fits"]
    assert run(["plan", "seven.fits", "one.csv", *options]) == 0
    capsys.readouterr()
    assert run(["verify", "p.fits"]) == 0
    assert "  of these the motion is safe wherever they stand: R0C3\n" in capsys.readouterr().out
    assert run(["verify", "p.fits", "--json"]) == 0
    said = {one["positioner"]: one["needed"] for one in json.loads(capsys.readouterr().out)["unknown"]}
    assert said == {"R0C2": True, "R0C3": False}


def test_a_guess_that_cannot_be_right_names_whom_it_touches():
    """Whoever it is that lies across the base of the unknown one."""
    plane = SEVEN.replace(bodies=(*SEVEN.bodies, Body(np.zeros((1, 2)), 2.0, "base", name="post")))
    angles, unknown = SEVEN.folded.copy(), np.zeros(7, bool)
    angles[MIDDLE], unknown[RIGHT] = (0.0, 0.0), True
    nowhere = np.full((7, 2), np.nan)
    state = fp.State(angles, ~unknown, unknown=unknown)
    problem = fp.Problem(plane, state, nowhere, 0.5, near_start="open")
    (text,) = problem.assumptions
    assert text.endswith("wherever it stood it would touch another, here R0C2)")
