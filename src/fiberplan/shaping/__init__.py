"""What a finished motion is made into for the motors: few-bit speeds."""

from fiberplan.shaping.quantization import Quantized, quantize

__all__ = ["Quantized", "quantize"]
