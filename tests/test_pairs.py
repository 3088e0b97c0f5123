"""Timing two commits in turn: what is asked of which, how often, and what the row says."""

import io
import json
import subprocess
import sys

import pytest

import fiberplan as fp
import pairs

pytestmark = pytest.mark.small


def test_every_planner_has_a_case():
    assert {name.split()[0] for name in pairs.cases()} == {"verify", *fp.planners.PLANNERS}


class Slow:
    """A child whose work takes 3 ms on this commit and 2 ms on the other, and 9 ms once."""

    def __init__(self, name, tree):
        self.tree, self.repeats, self.closed = tree, 7 if tree == "here" else 5, False
        Slow.made.append(self)

    def seconds(self, repeats):
        Slow.asked.append((self.tree, repeats))
        return 9e-3 if len(Slow.asked) == 1 else 3e-3 if self.tree == "here" else 2e-3

    def close(self):
        self.closed = True


def test_commits_are_asked_in_turn_and_as_often(monkeypatch):
    monkeypatch.setattr(Slow, "asked", [], raising=False)
    monkeypatch.setattr(Slow, "made", [], raising=False)
    monkeypatch.setattr(pairs, "Child", Slow)
    name, here, base, median, lower, upper, least = pairs.compared("fold", ["here", "there"], 4).split()
    assert (name, here, base) == ("fold", "3.00", "2.00")
    assert [float(each) for each in (median, lower, upper, least)] == pytest.approx([1.5, 1.5, 1.5, 1.5])
    first = [tree for tree, _ in Slow.asked][::2]
    assert sorted(first) == ["here", "here", "there", "there"]
    assert first[0] != first[1]
    assert {repeats for _, repeats in Slow.asked} == {7}  # of this commit, for both
    assert all(child.closed for child in Slow.made)


def test_a_child_works_as_often_as_it_is_asked(monkeypatch, capsys):
    done = []
    monkeypatch.setattr(pairs, "cases", lambda: {"quick": lambda: lambda: done.append(None)})
    monkeypatch.setattr(pairs, "LEAST", 1e-3)
    monkeypatch.setattr(sys, "stdin", io.StringIO("3\n20\n"))
    pairs.answer("quick")
    repeats, *seconds = map(json.loads, capsys.readouterr().out.split())
    assert repeats >= 1
    assert len(seconds) == 2
    assert len(done) == 2 + 3 + 20


def listed():
    said = subprocess.run(["git", "-C", pairs.ROOT, "worktree", "list"], capture_output=True, text=True)
    if said.returncode:
        pytest.skip("not in a git repository")
    return said.stdout


def test_the_other_commit_is_there_and_goes(monkeypatch, capsys):
    before, trees = listed(), []

    def compared(name, both, rounds):
        trees.extend(both)
        assert (both[1] / "src" / "fiberplan" / "__init__.py").is_file()
        return f"{name} {rounds}"

    monkeypatch.setattr(pairs, "compared", compared)
    monkeypatch.setattr(sys, "argv", ["pairs.py", "HEAD", "--rounds", "3", "--case", "verify"])
    pairs.main()
    assert capsys.readouterr().out.splitlines()[1:] == ["verify 3"]
    assert trees[0] == pairs.ROOT
    assert not trees[1].exists()
    assert listed() == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "a commit to compare with is needed"),
        (["HEAD", "--rounds", "0"], "at least one round"),
        (["HEAD", "--case", "fold"], "the cases are verify, greedy-fold"),
        (["no-such-commit"], "invalid reference: no-such-commit"),
    ],
)
def test_bad_arguments_are_one_line(arguments, said, monkeypatch, capsys):
    listed()
    monkeypatch.setattr(sys, "argv", ["pairs.py", *arguments])
    with pytest.raises(SystemExit, match="2"):
        pairs.main()
    assert said in capsys.readouterr().err.splitlines()[-1]
