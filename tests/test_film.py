"""Films: every picture shows what the plan says, and time runs as is written into it."""

import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import FiberplanError
from fiberplan.visuals import style
from fiberplan.visuals.film import animate, frame_times, frames, speed_for
from test_page import small_plan


@pytest.fixture(scope="module")
def plan():
    return small_plan()


def is_arm(picture):
    blue = np.array(to_rgb(style.OUTCOMES[fp.Outcome.ARRIVED].light)) * 255
    return (np.abs(picture[..., :3] - blue) < 2).all(axis=-1)


@pytest.mark.small
def test_frames_show_the_moments_they_are_of(plan):
    """A later frame is the same whether or not others were drawn before it, and arms move between frames."""
    times = np.array([0.0, plan.makespan / 2, plan.makespan])
    shown = [picture.copy() for picture in frames(plan, times, size=301)]
    assert {picture.shape for picture in shown} == {(300, 300, 4)}
    (alone,) = (picture.copy() for picture in frames(plan, times[2:], size=301))
    assert np.array_equal(alone, shown[2])
    assert (is_arm(shown[0]) != is_arm(shown[2])).sum() > 100


@pytest.mark.small
def test_time_runs_as_is_said():
    times = frame_times(3.0, 20.0, 2.0)
    steps = np.diff(times)
    moving = steps[steps > 0]
    assert moving[:-1] == pytest.approx(2.0 / 20.0)
    assert (times[0], times[-1]) == (0.0, 3.0)
    assert (steps == 0).sum() == 2 * 12  # 0.6 s at either end
    assert speed_for(5.0) == 1.0
    assert frame_times(44.0, 30.0, speed_for(44.0)).size / 30.0 == pytest.approx(10.0, abs=0.2)


@pytest.mark.small
def test_gif_runs_in_its_own_hundredths(plan, tmp_path):
    """A GIF cannot show 30 frames a second: it takes 33.3, and less motion in each, so that the scale is kept."""
    heard = []
    path = tmp_path / "plan.gif"
    animate(plan, path, speed=plan.makespan / 0.5, size=200, tell=lambda done, count: heard.append((done, count)))
    film, seconds = Image.open(path), 0.0
    for k in range(film.n_frames):
        film.seek(k)
        seconds += film.info["duration"] / 1000
    count = heard[-1][1]
    assert heard == [(k, count) for k in range(1, count + 1)]
    assert seconds == pytest.approx(0.03 * count)
    assert film.info["loop"] == 0


@pytest.mark.small
def test_mp4(plan, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    animate(plan, tmp_path / "plan.mp4", fps=10.0, speed=plan.makespan / 0.5, size=200)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "plan.mp4"))
    assert count == len(frame_times(plan.makespan, 10.0, plan.makespan / 0.5))
    assert seconds == pytest.approx(count / 10.0, abs=0.05)


@pytest.mark.small
@pytest.mark.parametrize(
    ("name", "options", "complaint"),
    [
        ("plan.avi", {}, "plan.avi: a film's name ends in .mp4 or .gif"),
        ("plan.gif", {"fps": 0.0}, "0 frames a second"),
        ("plan.gif", {"speed": -1.0}, "-1 times real"),
        ("plan.gif", {"size": 10}, "10 pixels"),
        ("plan.gif", {"speed": 1e-6}, "is too long"),
    ],
)
def test_no_such_film(name, options, complaint, plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FiberplanError, match=complaint):
        animate(plan, name, **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.small
def test_without_its_extra_an_mp4_is_refused_in_one_line(plan, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(FiberplanError, match=r"an \.mp4 needs the extra 'movie'"):
        animate(plan, tmp_path / "plan.mp4", size=200)
    assert list(tmp_path.iterdir()) == []


def test_command_says_what_is_missing(plan, tmp_path, monkeypatch, capsys):
    plan.write(tmp_path / "plan.fits")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert run(["animate", str(tmp_path / "plan.fits"), "-o", str(tmp_path / "plan.mp4")]) == 2
    assert "an .mp4 needs the extra 'movie'" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["plan.fits"]
    gif = tmp_path / "plan.gif"
    assert run(["animate", str(tmp_path / "plan.fits"), "--size", "200", "--speed", "60", "-o", str(gif)]) == 0
    assert capsys.readouterr().out == f"wrote {gif}: 60 x real speed\n"
