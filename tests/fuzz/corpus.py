"""Past failures, each with its right answer: a file of JSON a failure, in `tests/corpus`; `make test` asks them all.

A file says `why` it is there. What `make fuzz` finds is a `campaign` and a `seed`, and stays so until somebody makes it
small: `arms` as `fuzz.stated` has them, what holds for them, and the answer, whose name is the question:

- `touch`: while all go through their knots, do two come nearer than `room` [mm]? With clocks that are off by `jitter`
  [s], or with leave to begin nearer and come apart (`opening`).
- `path`: can those who are `moving` come from `start` [rad] to `goals` (by positioner) [rad], `room` apart?
- `outcomes`: what becomes of each if `Direct` plans from `start` to `goal` [rad], with `alternatives`, `max_time` [s]?
"""

import json
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.certificates.unreachable import decided
from fuzz.campaigns import CAMPAIGNS
from fuzz.stated import motion_of, plane_of

FOLDER = Path(__file__).parents[1] / "corpus"


def keep(folder: Path, campaign: str, seed: int, why: str) -> Path:
    """Write down what a campaign found; returns the file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{campaign}-{seed}.json"
    path.write_text(json.dumps({"why": why, "campaign": campaign, "seed": seed}, indent=1) + "\n")
    return path


def ask(path: Path, folder: Path) -> None:
    """Ask a file's question anew; `folder` is for what a campaign writes.

    Raises:
        AssertionError: the answer is another one; what a campaign raises.
    """
    said = json.loads(path.read_text())
    if "campaign" in said:
        CAMPAIGNS[said["campaign"]](np.random.default_rng(said["seed"]), folder)
        return
    (question,) = ANSWERS.keys() & said.keys()
    answer = ANSWERS[question](said, plane_of(said["arms"]))
    assert answer == said[question], f"{path.stem}: {question} is {answer}. {said['why']}"


def touch(said: dict, plane: fp.FocalPlane) -> bool:
    """Whether two come too near, or may."""
    motion, jitter = motion_of(said["arms"]), said.get("jitter", 0.0)
    return not fp.verify(plane, motion, said["room"], jitter, opening=said.get("opening", False)).ok


def path(said: dict, plane: fp.FocalPlane) -> bool | None:
    """Whether there is a path; None if that is not decided."""
    goals = {int(i): np.array(goal) for i, goal in said["goals"].items()}
    found, proof = decided(plane, said["moving"], goals, np.array(said["start"]), said["room"])
    return None if found is proof is None else found is not None


def outcomes(said: dict, plane: fp.FocalPlane) -> list[str]:
    """What becomes of each."""
    start, goal = (np.array(said[name], float) for name in ("start", "goal"))
    others = None if "alternatives" not in said else np.array(said["alternatives"], float)
    problem = fp.Problem(plane, start, goal, said["room"], alternatives=others)
    return [outcome.name for outcome in fp.planners.Direct(max_time=said.get("max_time")).plan(problem).outcomes]


ANSWERS = {question.__name__: question for question in (touch, path, outcomes)}
