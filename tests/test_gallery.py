"""The page of published figures: each beside its numbers, what is left below, and nothing that is not there."""

import re

import pytest

from fiberplan.cli.app import run
from fiberplan.reproductions import makarem2014, makarem2016, sabater2018, sayres2021
from fiberplan.reproductions.gallery import Paper, gallery
from fiberplan.reproductions.rows import Shown, value

pytestmark = pytest.mark.small

FIGURES = {
    "one.png": Shown("Fig. 1: <times>", ("Fig. 1:",)),
    "two.png": Shown("Fig. 2: shares", ("Fig. 2:",)),
    "none.png": Shown("Fig. 3: never drawn", ("Fig. 3:",)),
}
ROWS = [
    value("Fig. 1: time & place", 2.5, 2.25, 7),
    value("Fig. 2: share", "> 0.9", None, 0),
    value("Fig. 3: lone", None, 1.0, 1),
]


@pytest.fixture
def page(tmp_path):
    (tmp_path / "p").mkdir()
    for name in ("one.png", "two.png"):
        (tmp_path / "p" / name).write_bytes(b"")
    gallery([Paper("paper2020", "A paper.", "n: trials", FIGURES, ROWS, "p")], tmp_path / "index.html", 7)
    return (tmp_path / "index.html").read_text()


def test_each_figure_stands_beside_its_own_numbers(page):
    _, first, second = page.split("<section class='figure'>")
    rest = page
    assert "src='p/one.png' alt='Fig. 1: &lt;times&gt;'" in first
    assert "<th scope='row'>Fig. 1: time &amp; place</th><td>2.5</td><td>2.25</td><td>7</td>" in first
    assert "Fig. 2" not in first
    assert "<td>&gt; 0.9</td><td>none</td><td>0</td>" in second
    assert "none.png" not in rest
    assert rest.index("What belongs to no figure") < rest.index("Fig. 3: lone")


def test_it_asks_for_nothing_from_elsewhere_and_every_part_has_a_name(page):
    assert not re.search(r"https?:|<script", page)
    assert page.count("<img") == page.count(" alt=") == 2
    assert page.isascii()


@pytest.mark.parametrize("paper", [makarem2014, makarem2016, sabater2018, sayres2021], ids=lambda p: p.__name__[-11:])
def test_every_paper_says_what_its_figures_show(paper):
    assert all(name.endswith(".png") and shown.caption and shown.rows for name, shown in paper.FIGURES.items())


def test_all_or_one(capsys):
    assert run(["reproduce", "sayres2021", "--all"]) == 2
    assert capsys.readouterr().err == "fiberplan: error: reproduce: either sayres2021 or --all, not both\n"
