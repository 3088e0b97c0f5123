"""Scenes for planners: seeded problems, from two arms to 100,000, and real ones where their data are at hand.

To add one, write a function of a seed and the data folder that returns a `fiberplan.Problem`, and name it as a `Scene`
in its module's `SCENES`.
"""

from scenes import miradas, moons, real, sdss, small, uniform
from scenes.scene import Scene

MODULES = (small, miradas, uniform, sdss, real, moons)
SCENES: dict[str, Scene] = {scene.name: scene for module in MODULES for scene in module.SCENES}

__all__ = ["SCENES", "Scene"]
