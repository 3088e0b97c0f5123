"""Scenes for planners: seeded problems, from two arms to 100,000, and real ones where their data are at hand.

To add one, write a function of a seed and the data folder that returns a `fiberplan.Problem`, and name it as a `Scene`
in its module's `SCENES`.
"""

from scenes import moons, sdss, small, uniform
from scenes.scene import Scene

SCENES: dict[str, Scene] = {s.name: s for s in (*small.SCENES, *uniform.SCENES, *sdss.SCENES, *moons.SCENES)}

__all__ = ["SCENES", "Scene"]
