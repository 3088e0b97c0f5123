"""Named instruments, and one module for each real instrument: its focal plane and its target files.

- ``builtin/*.toml``: the instruments that are built in, a source beside every number
- `definition`: a focal plane from such a file
- `sdss`, `sdss_targets`: calibration folders of SDSS-V, and its record of a configuration
- `moons`, `moons_targets`: configuration files of the MOONS prototype, and its fields
"""

from pathlib import Path

__all__ = ["builtin", "names"]

_BUILTIN = Path(__file__).parent / "builtin"


def names() -> tuple[str, ...]:
    """Names of the built-in instruments, in alphabetical order."""
    return tuple(sorted(path.stem for path in _BUILTIN.glob("*.toml")))


def builtin(name: str) -> Path:
    """The file that defines a built-in instrument."""
    return _BUILTIN / f"{name}.toml"
