"""The page: head and texts as HTML, escaped; views as data; script and style inside."""

import base64
import hashlib
import html
from collections.abc import Sequence
from importlib import resources
from string import Template
from typing import NamedTuple

import msgspec

from farside.logs.events import sign_text
from farside.logs.file.reading import LogFile
from farside.logs.report.gather import views_of
from farside.logs.result import Outcome, RunResult
from farside.node import to_s

_SCRIPTS = (
    "shapes.js",
    "yard.js",
    "time.js",
    "draw.js",
    "views.js",
    "lanes.js",
    "strip.js",
    "curves.js",
    "map.js",
    "policy.js",
    "texts.js",
    "main.js",
)
_GOALS = 12
_MARKS = {Outcome.SUCCESS: "✓", Outcome.FAILURE: "✗", Outcome.ABORTED: "■"}

_SWITCH = """<label class="switch"><input type="checkbox" id="switch" role="switch">
as the ground saw it</label>"""

_POLICY = """<section class="so"><h2>Policy map</h2>
<p class="note">The height of a column is the policy value P_v of its place: the least estimated
cost from there to the goal. The map is that of the top-goal at the time of the slider, as it was
when that became the top-goal.</p>
<p><select id="policy-moment" aria-label="policy map"></select></p>
<p id="policy-title"></p>
<div class="policy"><svg id="columns" role="img" aria-label="policy map as columns"></svg>
<div class="scroll" id="depths"></div></div></section>"""


class _Mission(msgspec.Struct):
    """What the page tells of `mission.json`."""

    about: str = ""


class _Head(NamedTuple):
    """What stands above the slider."""

    title: str
    markup: str


def report_page(log: LogFile) -> str:
    """The page of a run; the same log gives the same page, to the byte.

    A page of a log as the ground had it holds nothing else.

    Args:
        log: the log.

    Raises:
        LogError: if a message cannot be decoded.
    """
    views = views_of(log)
    head = _head(log)
    script = '(() => {\n"use strict";\n' + "\n".join(map(_file, _SCRIPTS)) + "})();\n"
    style = _file("page.css")
    return Template(_file("page.html")).substitute(
        script_hash=_hash(script),
        style_hash=_hash(style),
        title=html.escape(head.title),
        style=style,
        body=' class="ground"' if log.is_as_ground else "",
        head=head.markup,
        switch="" if log.is_as_ground else _SWITCH,
        policy=_POLICY if any(view.maps for view in views.values()) else "",
        foot=_foot(log),
        data=_inert(msgspec.json.encode(views)),
        script=script,
    )


def _file(name: str) -> str:
    return (resources.files("farside.logs.report") / "static" / name).read_text("utf-8")


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _inert(data: bytes) -> str:
    """JSON that no parser of HTML takes for markup: within strings `<` has an escape."""
    return data.decode().replace("<", "\\u003c").replace("\u2028", "\\u2028")


# --- the head ----------------------------------------------------------------------------------


def _head(log: LogFile) -> _Head:
    run = log.metadata.get("farside.run", {})
    name, seed = run.get("mission", "a run"), run.get("seed", "")
    if log.is_as_ground:
        at = f"{to_s(log.end_ns):.1f} s"
        title = f"{name}: as the ground had it at {at}"
        markup = (
            f'<div class="top"><h1>{html.escape(name)}</h1></div>'
            f"<p>As the ground had it at {at}: what it had learned by then, and nothing else. "
            "How the run ended is not known.</p>"
        )
        return _Head(title, markup + _facts([("seed", seed)]) + _damage(log))
    result, problems = _result(log)
    outcome = str(result.outcome) if result else "not finished"
    mark = f"{_MARKS[result.outcome] if result else '■'} {outcome}"
    digest = [("digest", result.digest[:16])] if result and result.digest else []
    length = ("simulated", f"{to_s(log.end_ns):.1f} s")
    versions = ("farside", run.get("farside", ""))
    markup = (
        f'<div class="top"><h1>{html.escape(name)}</h1>'
        f'<span class="so outcome {html.escape(outcome)}">{html.escape(mark)}</span></div>'
        f'<p class="so soft">{html.escape(_about(log))}</p>'
        + _facts([("seed", seed), versions])
        + _facts([length, *digest], so=True)
        + _damage(log, problems)
        + _summary(result)
        + '<p class="known soft">What became of the run is not known at the ground.</p>'
    )
    return _Head(f"{name}, seed {seed}: {outcome}", markup)


def _facts(facts: list[tuple[str, str]], *, so: bool = False) -> str:
    items = (f"<li>{html.escape(name)} {html.escape(value)}</li>" for name, value in facts if value)
    return f'<ul class="facts{" so" if so else ""}">{"".join(items)}</ul>'


def _damage(log: LogFile, problems: tuple[str, ...] = ()) -> str:
    found = [*log.damage, *problems]
    if not log.complete:
        found.append("Nobody finished this log: its run is under way, or its writer was stopped.")
    if not found:
        return ""
    items = "".join(f"<li>{html.escape(one)}</li>" for one in found)
    return (
        '<div class="damage" id="damage"><b>The log is not whole.</b>'
        f'<ul class="plain">{items}</ul></div>'
    )


def _summary(result: RunResult | None) -> str:
    """Expectations, goals and the counts of the link, of what was so."""
    expectations = "<p>The run ended before its expectations were judged.</p>"
    goals = ""
    if result is not None and result.expectations:
        expectations = _table(
            ("expected", "", "found"),
            [
                (one.name, "✓ met" if one.met else "✗ not met", one.detail)
                for one in result.expectations
            ],
            unmet=[not one.met for one in result.expectations],
        )
    elif result is not None and result.outcome is not Outcome.ABORTED:
        expectations = "<p>The mission expects nothing.</p>"
    if result is not None and result.goals:
        rows = [
            (
                sign_text(goal.tokens),
                str(goal.source),
                f"{goal.set_s:.1f} s",
                "not reached" if goal.reached_s is None else f"{goal.reached_s:.1f} s",
            )
            for goal in result.goals[:_GOALS]
        ]
        if len(result.goals) > _GOALS:
            rows.append((f"and {len(result.goals) - _GOALS} more", "", "", ""))
        goals = "<h2>Goals</h2>" + _table(("goal", "set by", "set", "reached"), rows)
    return (
        f'<section class="so summary"><div><h2>Expectations</h2>{expectations}</div>'
        f'<div>{goals}<h2>Link</h2><div class="scroll" id="link-table"></div></div></section>'
    )


def _table(
    heads: tuple[str, ...], rows: Sequence[tuple[str, ...]], unmet: Sequence[bool] = ()
) -> str:
    marks = [" class=unmet" if bad else "" for bad in unmet] or [""] * len(rows)
    body = "".join(
        f"<tr{mark}>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>"
        for row, mark in zip(rows, marks, strict=True)
    )
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in heads)
    return f'<div class="scroll"><table class="expect"><tr>{head}</tr>{body}</table></div>'


def _result(log: LogFile) -> tuple[RunResult | None, tuple[str, ...]]:
    attached = log.attachments.get("result.json")
    if attached is None:
        return None, ()
    try:
        return msgspec.json.decode(attached.data, type=RunResult), ()
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        return None, (f"The outcome cannot be read from result.json: {error}",)


def _about(log: LogFile) -> str:
    attached = log.attachments.get("mission.json")
    if attached is None:
        return ""
    try:
        return msgspec.json.decode(attached.data, type=_Mission).about
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return ""  # `Asked` tells of it


def _foot(log: LogFile) -> str:
    run = log.metadata.get("farside.run", {})
    version = html.escape(run.get("farside", "?"))
    return f"<p>Made by farside report from a log of Farside {version}. Times are simulated.</p>"
