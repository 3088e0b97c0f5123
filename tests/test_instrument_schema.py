"""The JSON Schema of instrument files, against the files there are."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fiberplan import instruments
from fiberplan.cli.app import run
from fiberplan.instruments.definition_model import schema

pytestmark = pytest.mark.small

BUILTIN = sorted((Path(instruments.__file__).parent / "builtin").glob("*.toml"))
RULES = {
    "type",
    "const",
    "enum",
    "oneOf",
    "minimum",
    "maximum",
    "exclusiveMinimum",
    "minItems",
    "maxItems",
    "minLength",
}
RULES |= {
    "minLength",
    "minProperties",
    "prefixItems",
    "items",
    "properties",
    "additionalProperties",
    "required",
    "$ref",
    "$defs",
}
WORDS = {"title", "description", "examples", "default", "discriminator", "$schema"}
KINDS = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": int | float}


def wrong(value, rule, whole):
    """What is wrong with a value by the RULES of a JSON Schema; None if nothing is."""
    assert rule.keys() <= RULES | WORDS, "a rule that this test would not see"
    if "$ref" in rule:
        return wrong(value, whole["$defs"][rule["$ref"].split("/")[-1]], whole)
    if "type" in rule and (
        not isinstance(value, KINDS[rule["type"]]) or (isinstance(value, bool) and rule["type"] != "boolean")
    ):
        return f"{value!r} is no {rule['type']}"
    if value != rule.get("const", value) or value not in rule.get("enum", [value]):
        return f"{value!r} is not one of the values there are"
    if "oneOf" in rule and sum(wrong(value, one, whole) is None for one in rule["oneOf"]) != 1:
        return f"{value!r} is not one of its alternatives"
    if isinstance(value, int | float) and not (
        rule.get("minimum", -np.inf) <= value <= rule.get("maximum", np.inf)
        and value > rule.get("exclusiveMinimum", -np.inf)
    ):
        return f"{value!r} is out of range"
    if isinstance(value, list | str):
        kind = "Items" if isinstance(value, list) else "Length"
        if not rule.get(f"min{kind}", 0) <= len(value) <= rule.get(f"max{kind}", np.inf):
            return f"{value!r} has {len(value)} entries"
    inner = []
    if isinstance(value, list):
        inner = zip(value, rule.get("prefixItems", [rule.get("items", {})] * len(value)), strict=True)
    if isinstance(value, dict):
        fields, others = rule.get("properties", {}), rule.get("additionalProperties", {})
        if not set(rule.get("required", ())) <= set(value) or len(value) < rule.get("minProperties", 0):
            return f"{value!r} lacks a field"
        if others is False and not set(value) <= set(fields):
            return f"{value!r} has a field too many"
        inner = ((v, fields.get(key, others)) for key, v in value.items())
    return next((said for v, r in inner if (said := wrong(v, r, whole)) is not None), None)


def test_schema_admits_every_built_in_instrument():
    assert len(BUILTIN) > 6
    for path in BUILTIN:
        assert wrong(tomllib.loads(path.read_text(encoding="utf-8")), schema(), schema()) is None, path.name


def test_schema_admits_the_documentation_and_refuses_what_is_wrong(examples):
    for path in examples.glob("*.toml"):
        assert wrong(tomllib.loads(path.read_text()), schema(), schema()) is None, path.name
    good = tomllib.loads((examples / "hexagon.toml").read_text())
    for change in (
        {"format": 2},
        {"nane": "x"},
        {"arm": {"length": -1}},
        {"arm": {}},
        {"fibers": 3},
        {"fibers": {"f": [1]}},
        {"grid": {"kind": "ring", "count": 1.5, "radius": 2}},
        {"bodies": [{"link": "gamma"}]},
        {"positioner": [{"id": "A", "online": 1}]},
    ):
        assert wrong(good | change, schema(), schema()) is not None, change


def test_schema_describes_every_field():
    parts = {"instrument": schema(), **schema()["$defs"]}
    said = {f"{part}.{name}": f.get("description") for part, r in parts.items() for name, f in r["properties"].items()}
    assert not [name for name, text in said.items() if not text]
    assert sum("mm]" in text or "[deg" in text for text in said.values()) > 30


def test_the_command_prints_it(capsys):
    assert run(["instruments", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()
