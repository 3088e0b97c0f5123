"""Figures: true shapes, one palette, readable to the colour-blind."""

import itertools

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from fiberplan.errors import PlanError
from fiberplan.plan import Outcome
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, save
from fiberplan.visuals.figures import draw
from fiberplan.visuals.shapes import rounded
from test_page import MIXED, small_plan

pytestmark = pytest.mark.small

# linear RGB as seen without the long- or the middle-wavelength cones (Machado, Oliveira and Fernandes 2009, severity 1)
VISION = {
    "full": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}


def lab(colour: str, vision: str) -> np.ndarray:
    """CIE L*a*b* of a colour as seen by someone."""
    srgb = np.array(to_rgb(colour))
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(VISION[vision] @ linear, 0, 1)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    f = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize("background", ["light", "dark"])
def test_outcomes_can_be_told_apart(vision, background):
    colours = {o.name: getattr(c, background) for o, c in style.OUTCOMES.items()} | {
        "paper": getattr(style.PAPER, background),
        "contact": getattr(style.CONTACT, background),
    }
    for (a, one), (b, other) in itertools.combinations(colours.items(), 2):
        assert np.linalg.norm(lab(one, vision) - lab(other, vision)) > 15, (a, b)


def test_every_outcome_has_a_colour_and_a_label():
    assert set(style.OUTCOMES) == set(style.LABELS) == set(Outcome)


@pytest.mark.large
@pytest.mark.parametrize("time", [None, 0.0, 7.3])
@pytest.mark.parametrize("bodies", [None, MIXED], ids=["capsules", "every kind of body"])
def test_draws_a_plan(tmp_path, time, bodies):
    before = dict(matplotlib.rcParams)
    plan = small_plan(**({} if bodies is None else {"bodies": bodies}))
    draw(plan, "focal-plane", tmp_path / "plan.png", time=time)
    picture = (tmp_path / "plan.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 20_000
    assert dict(matplotlib.rcParams) == before


@pytest.mark.large
def test_moments_differ(tmp_path):
    for time in (0.0, 16.0):
        draw(small_plan(), "focal-plane", tmp_path / f"{time}.png", time=time)
    assert (tmp_path / "0.0.png").read_bytes() != (tmp_path / "16.0.png").read_bytes()


def test_unwritable_picture(tmp_path):
    with pytest.raises(PlanError, match="cannot be written"):
        draw(small_plan(), "focal-plane", tmp_path / "missing" / "plan.png")


@pytest.mark.parametrize("points", [[[0, 0]], [[0, 0], [3, 0]], [[0, 0], [2, 0], [0, 1]]])
def test_rounding_adds_the_radius_all_round(points):
    piece = np.array(points, float)
    outline = rounded(piece, 0.5)
    assert outline.min(axis=0) == pytest.approx(piece.min(axis=0) - 0.5)
    assert outline.max(axis=0) == pytest.approx(piece.max(axis=0) + 0.5)
    np.testing.assert_array_equal(rounded(piece[:1], 0.0), piece[:1])


def test_blank_figures_share_the_style(tmp_path):
    figure, axes = blank((5, 3), rows=1, columns=2)
    axes[0].plot([0, 1], [1, 2])
    save(figure, tmp_path / "two.png")
    assert axes[0].lines[0].get_color() == style.SERIES[0]
    assert (tmp_path / "two.png").exists()
