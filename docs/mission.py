"""Writes the reference in docs/mission.md: every table and key, from the types that read them."""

import json
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from farside.missions.format import mission_schema

PAGE = Path(__file__).with_name("mission.md")
MARK = "<!-- From here on the page is made by `make reference`. -->\n"
# The longest suffix first.
UNITS = {
    "_m_s2": "m/s²",
    "_rad_s": "rad/s",
    "_bit_s": "bit/s",
    "_m_s": "m/s",
    "_byte": "byte",
    "_frame": "frames",
    "_deg": "°",
    "_rad": "rad",
    "_ms": "ms",
    "_kg": "kg",
    "_s": "s",
    "_m": "m",
    "_n": "N",
    "_j": "J",
    "_w": "W",
}

Schema = dict[str, Any]


class Reference:
    """The tables of a mission file, in the order in which its keys name them."""

    def __init__(self) -> None:
        schema = mission_schema()
        self._definitions: dict[str, Schema] = schema["definitions"]
        self._headings: defaultdict[str, list[str]] = defaultdict(list)
        self._name("MissionFile", "", array=False)

    def text(self) -> str:
        """The reference as Markdown."""
        return "\n".join(line for name in self._headings for line in self._section(name))

    def _name(self, name: str, path: str, *, array: bool) -> None:
        """Give a table and all within it their headings."""
        definition = self._definitions[name]
        if path:
            self._headings[name].append(f"`[[{path}]]`" if array else f"`[{path}]`")
            if len(self._headings[name]) > 1:
                return
        else:
            self._headings[name].append("Top of the file")
        for key, value in definition.get("properties", {}).items():
            inner = f"{path}.{key}" if path else key
            for kind, is_array in _tables_in(value, self._definitions):
                self._name(kind, inner, array=is_array)

    def _section(self, name: str) -> Iterator[str]:
        definition = self._definitions[name]
        tags = [
            f'`{key} = "{value["enum"][0]}"`'
            for key, value in definition["properties"].items()
            if _is_tag(value)
        ]
        headings = list(dict.fromkeys(self._headings[name]))
        yield f"### {', '.join([' and '.join(headings), *tags])}\n"
        yield f"{definition['description']}\n"
        rows = [row for row in self._rows(definition) if row]
        if rows:
            yield "| key | value | unit | default | meaning |\n|---|---|---|---|---|"
            yield from (f"{row}" for row in rows)
            yield ""

    def _rows(self, definition: Schema) -> Iterator[str]:
        required = definition.get("required", [])
        for key, value in definition["properties"].items():
            if _is_tag(value):
                continue
            default = "required" if key in required else _default(value)
            cells = (
                f"`{key}`",
                self._value(value),
                _unit(key),
                default,
                str(value["description"]).replace("|", "\\|"),
            )
            yield f"| {' | '.join(cells)} |"

    def _value(self, value: Schema) -> str:  # noqa: PLR0911 - a kind each
        """What a key takes, in words."""
        match value:
            case {"$ref": str(ref)}:
                definition = self._definitions[_named(ref)]
                return self._value(definition) if "enum" in definition else "a table"
            case {"enum": list(choices)}:
                return ", ".join(f'`"{choice}"`' for choice in choices)
            case {"anyOf": list(kinds)}:
                return " or ".join(dict.fromkeys(map(self._value, kinds)))
            case {"type": "array", "items": items}:
                inner = self._value(items)
                return "an array of tables" if inner == "a table" else f"an array: {inner}"
            case {"type": "object"}:
                return "a table: names and values of your own"
            case {"type": "boolean"}:
                return "`true` or `false`"
            case {"type": "string", **rest}:
                return f"text, as `{rest['pattern']}`" if "pattern" in rest else "text"
            case {"type": ("number" | "integer") as kind}:
                whole = "whole number" if kind == "integer" else "number"
                return f"{whole}{_range(value)}"
        raise ValueError(f"no words for {value}")


def _is_tag(value: Schema) -> bool:
    return "description" not in value and len(value.get("enum", ())) == 1


def _named(ref: str) -> str:
    return ref.rpartition("/")[2]


def _tables_in(
    value: Schema, definitions: dict[str, Schema], *, array: bool = False
) -> Iterator[tuple[str, bool]]:
    """The tables that a key takes, each with whether it takes an array of them."""
    if (ref := value.get("$ref")) and definitions[_named(ref)].get("type") == "object":
        yield _named(ref), array
    for kind in value.get("anyOf", ()):
        yield from _tables_in(kind, definitions, array=array)
    if "items" in value:
        yield from _tables_in(value["items"], definitions, array=True)


def _unit(key: str) -> str:
    return next((unit for suffix, unit in UNITS.items() if key.endswith(suffix)), "")


def _range(value: Schema) -> str:
    bounds = (
        (">", "exclusiveMinimum"),
        ("≥", "minimum"),
        ("<", "exclusiveMaximum"),
        ("≤", "maximum"),
    )
    found = [f"{sign} {value[name]:g}" for sign, name in bounds if name in value]
    return f" {' and '.join(found)}" if found else ""


def _default(value: Schema) -> str:
    match value.get("default"):
        case None:
            return "none"
        case dict() | []:
            return "its defaults" if value.get("default") else "empty"
        case default:
            return f"`{json.dumps(default)}`"


def page(text: str) -> str:
    """The page `text` with the reference as it should be."""
    before, mark, _ = text.partition(MARK)
    if not mark:
        raise SystemExit(f"{PAGE}: expected the line {MARK.strip()}, found none")
    return f"{before}{MARK}\n{Reference().text()}"


if __name__ == "__main__":
    target = Path(sys.argv[1]) if sys.argv[1:] else PAGE
    target.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
