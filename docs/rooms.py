"""Draw the rooms of ``docs/architecture.md`` from the layer contracts of pyproject.toml: ``python docs/rooms.py``."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "architecture.md"
WIDTH = 86  # of a drawing, between its outer walls


def contract(name: str) -> list[list[str]]:
    """Rooms of a layer contract, the highest level first."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (c["layers"] for c in contracts if c["id"] == name)
    return [[room.strip(" ()") for room in re.split("[|:]", layer)] for layer in layers]


def drawing(levels: list[list[str]]) -> str:
    """Levels as rows of cells, numbered from the top."""
    wall = "    +" + "-" * WIDTH + "+"
    rows = [wall]
    for number, rooms in enumerate(levels, 1):
        room_for = WIDTH - (len(rooms) - 1)
        widths = [room_for // len(rooms) + (k < room_for % len(rooms)) for k in range(len(rooms))]
        cells = "|".join(room.center(width) for room, width in zip(rooms, widths, strict=True))
        rows += [f"{number:>3} |{cells}|", wall]
    return "\n".join(rows)


def drawn(text: str) -> str:
    """The page with each drawing that it names made anew."""

    def block(match: re.Match[str]) -> str:
        return f"{match[1]}\n```\n{drawing(contract(match[2]))}\n```"

    return re.sub(r"(<!-- drawn by docs/rooms.py: (\w+) -->)\n```\n.*?```", block, text, flags=re.DOTALL)


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text()))
