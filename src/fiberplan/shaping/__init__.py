"""What a finished motion is made into for the motors.

- `quantization`: joint speeds in a few bits, held per tick, as safe as the motion they follow
- `levels`: the speeds that a joint can have
"""

from fiberplan.shaping.quantization import Quantized, quantize

__all__ = ["Quantized", "quantize"]
