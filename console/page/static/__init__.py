"""The script and the style of the page; those that draw a yard are the report's."""

from functools import cache
from importlib import resources

from fastapi import Response

_REPORTS = ("shapes.js", "yard.js")
_OWN = ("cues.js", "map.js", "strip.js", "hands.js", "pad.js", "main.js")


@cache
def _script() -> str:
    report = resources.files("farside.logs.report") / "static"
    own = resources.files(__name__)
    parts = [(report / name).read_text("utf-8") for name in _REPORTS]
    parts += [(own / name).read_text("utf-8") for name in _OWN]
    return '(() => {\n"use strict";\n' + "\n".join(parts) + "})();\n"


def script() -> Response:
    """The page's script."""
    return Response(_script(), media_type="text/javascript")


def style() -> Response:
    """The page's style."""
    css = (resources.files(__name__) / "page.css").read_text("utf-8")
    return Response(css, media_type="text/css")
