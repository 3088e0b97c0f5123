"""Speed of the HTML page: how large it is, how soon it shows the first picture, how many frames a second it plays.

    python benchmarks/page.py [--seconds 3] [--only outlines] [--colour now] [--browser /usr/bin/chromium]

Headless Chromium with software rendering, a window of 1280 x 800, the whole array in view, everybody in motion in every
frame: alpha turns from end to end, folded. Opening is from the start of navigation to the first picture, in a browser
that runs already. Frames are counted while the plan plays; beside them the CPU time of the page's main thread a frame,
which other work on the machine hardly changes.
"""

import argparse
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem
from fiberplan.visuals import show

DURATION = 20.0  #: of each motion [s]
KNOTS = 12  #: of each positioner
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")


def scenes() -> dict[str, tuple[FocalPlane, float, float]]:
    """Name -> array, and the figures to reach: seconds to open and frames a second."""
    return {
        "547 capsules (sayres2021)": (FocalPlane.load("sayres2021"), 1.5, 30.0),
        "5,000 true outlines (desi)": (FocalPlane.load("desi"), 1.5, 30.0),
        "19,927 capsules": (FocalPlane.hexagonal(81, 22.4), 1.5, 24.0),
    }


def turning(plane: FocalPlane) -> Plan:
    """Everybody turns alpha from end to end in `DURATION`, folded, and arrives."""
    times = np.linspace(0.0, DURATION, KNOTS)
    angles = np.repeat(plane.folded[None], KNOTS, axis=0)
    angles[:, :, 0] = plane.lower[:, 0] + (times / DURATION)[:, None] * (plane.upper - plane.lower)[:, 0]
    problem = Problem(plane, angles[0], angles[-1])
    return Plan(problem, Trajectory.from_samples(times, angles), (Outcome.ARRIVED,) * plane.n, "none")


def opened(page: Page, path: Path) -> float:
    """Seconds from the start of navigation to the first picture."""
    page.goto(path.as_uri())
    return page.evaluate("performance.getEntriesByName('first picture')[0].startTime") / 1e3


def frames(page: Page, seconds: float) -> tuple[float, float]:
    """Frames a second while the plan plays, and CPU seconds of the page's main thread a frame."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def busy() -> float:
        metrics = session.send("Performance.getMetrics")["metrics"]
        return next(metric["value"] for metric in metrics if metric["name"] == "TaskDuration")

    page.click("#play")
    before = busy()
    count, took = page.evaluate(
        """(seconds) => new Promise((done) => {
          let count = -1, begin = 0;
          const tick = (now) => {
            if (++count === 0) begin = now;
            if (now - begin >= 1000 * seconds) done([count, (now - begin) / 1000]);
            else requestAnimationFrame(tick);
          };
          requestAnimationFrame(tick);
        })""",
        seconds,
    )
    return count / took, (busy() - before) / count


def main() -> None:
    """Print a row a scene."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=3.0, help="how long each plan plays")
    parser.add_argument("--browser", default=shutil.which("chromium") or shutil.which("google-chrome"))
    parser.add_argument("--only", default="", help="scenes whose name contains this")
    parser.add_argument("--colour", default="outcome", help="what the colours say: now, progress, ...")
    options = parser.parse_args()
    print(f"{'scene':28} {'page':>8} {'show':>7} {'opens':>7} {'frames/s':>9} {'CPU each':>9}   to reach")
    with sync_playwright() as driver, tempfile.TemporaryDirectory() as folder:
        browser = driver.chromium.launch(executable_path=options.browser, args=QUIET)
        browser.new_page().goto("about:blank")
        for name, (plane, soon, smooth) in scenes().items():
            if options.only not in name:
                continue
            plan, path = turning(plane), Path(folder) / "page.html"
            assert plan.certificate is not None  # proven before the clock starts
            begin = time.process_time()
            show(plan, path)
            took = time.process_time() - begin
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            seconds = opened(page, path)
            page.select_option("#colour", options.colour)
            rate, cpu = frames(page, options.seconds)
            size, figures = path.stat().st_size / 1e6, f"<= {soon} s, >= {smooth:.0f}"
            print(
                f"{name:28} {size:5.2f} MB {took:5.2f} s {seconds:5.2f} s {rate:9.1f} {1e3 * cpu:6.1f} ms   {figures}"
            )
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
