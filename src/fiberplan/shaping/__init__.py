"""What a finished motion is made into for the motors.

- `shape`: a motion within the motors' accelerations and least speeds, proven anew
- `replanned`: `plan_for_motors`, which mends a plan, or asks for another, where what motors make of it comes too near
- `waiting`: which of two that motors bring too near each other waits, and how long
- `ramps`: corners rounded by ramps of bounded acceleration
- `bursts`: turns that are too slow for a motor made of turns and rests
- `whole_steps`: a motion in segments and whole steps; `following`: those of one joint; `strokes`: what one turn can be
- `knots`: knots of motions of which each joint is shaped by itself
- `quantization`: joint speeds in a few bits, held per tick, as safe as the motion they follow
- `levels`: the speeds that a joint can have
- `supply_load`: how many robots of a power supply move at once
- `staggering`: `staggered`, which lets some begin later, so that these are few; `delays`: which, and by how much;
  `delayed_pairs`: which pairs that leaves apart; `hurried`: the same paths as fast as joints can
"""

from fiberplan.shaping.quantization import Quantized, quantize
from fiberplan.shaping.replanned import plan_for_motors
from fiberplan.shaping.shape import Shaped, shape
from fiberplan.shaping.staggering import Staggered, staggered
from fiberplan.shaping.supply_load import load

__all__ = ["Quantized", "Shaped", "Staggered", "load", "plan_for_motors", "quantize", "shape", "staggered"]
