"""The blocks of the screen, each as rows of a width: status, next, on the way, state, events."""

from collections.abc import Iterator

from rich.text import Text

from farside.console.screen.screen import (
    AlarmRow,
    CommandRow,
    EventRow,
    OptionRow,
    ProposalCard,
    Screen,
    Tone,
    way_sign,
)
from farside.console.stick.cues import Edge, cue_of, edge_of
from farside.console.text.chart import order_mark
from farside.console.text.words import (
    BOLD,
    DIM,
    STYLES,
    filled,
    flowing,
    joined,
    line,
    said,
    told,
    wrapped,
)
from farside.console.wording import clock_text, percent, span_text
from farside.escaping import printable
from farside.ground.view.view import OptionKind

_EDGES = {
    Edge.PLAIN: (" ", " "),
    Edge.BARRED: ("║", "║"),
    Edge.HATCHED: ("▒", "▒"),
    Edge.LIT: ("»", "«"),
}
_EDGE_STYLES = {
    Edge.PLAIN: "",
    Edge.BARRED: "bold red",
    Edge.HATCHED: "yellow",
    Edge.LIT: "bold cyan",
}
_KINDS = {
    OptionKind.FREE: "free",
    OptionKind.INVALID: "invalid",
    OptionKind.PROBLEMATIC: "risky",
    OptionKind.PROPOSED: "proposed",
}
_WINDOW_WIDTH = 12
_WAY_HANG = 3
_OPTION_HANG = 6
_OPTION_WIDE = 50  # columns from which what is found of the options stands in a column
_WIDEST = 100  # columns from which the end is told, too
_WIDE = 76  # columns from which clocks have their whole names, and events both of their times


# --- status ------------------------------------------------------------------------------------


def status_rows(screen: Screen, width: int) -> list[Text]:
    """The two rows that never go: the clocks with the pace, and the mode with the link."""
    return [line(_clocks(screen, width), width), line(_state(screen), width)]


def _clocks(screen: Screen, width: int) -> Text:
    here, rover = clock_text(screen.now_ns), clock_text(screen.rover_ns)
    if width < _WIDE:
        return Text.assemble(
            ("here ", DIM), (here, BOLD), (" rover ", DIM), rover, " ", _pace(screen)
        )
    return Text.assemble(
        (f" {printable(screen.mission)} ", BOLD),
        ("  here ", DIM),
        (here, BOLD),
        (f" of {clock_text(screen.end_ns)}" if width >= _WIDEST else "", DIM),
        ("  rover, as far as light goes ", DIM),
        rover,
        "   ",
        _pace(screen),
    )


def _pace(screen: Screen) -> Text:
    if screen.over:
        return Text("■ over", style=BOLD)
    if screen.standing:
        return told(screen.standing, Tone.CAUTION)
    if screen.paused:
        return Text("‖ paused", style=STYLES[Tone.CAUTION])
    if screen.warp:
        return Text(f"▸▸ {printable(screen.warp)}", style=BOLD)
    return Text(f"▶ {screen.speed:g}x", style=BOLD)


def _state(screen: Screen) -> Text:
    """What must not be cut comes first."""
    tone = STYLES[screen.mode.tone]
    mode = printable(screen.mode.text)
    parts = [Text(f" [{mode}] " if screen.mode.stale else f" {mode} ", style=f"{tone} reverse")]
    if sign := way_sign(screen):
        parts.append(Text(f" {sign} ", style="bold cyan reverse"))
    alarms = sum(not alarm.acknowledged for alarm in screen.alarms)
    if alarms:
        words = f" {alarms} ALARM{'S' if alarms > 1 else ''} "
        parts.append(Text(words, style="bold red reverse"))
    return Text.assemble(joined(parts, " "), " ", joined(map(said, screen.status)))


# --- next --------------------------------------------------------------------------------------


def next_rows(screen: Screen, width: int, height: int) -> list[Text]:
    """What happens if nothing is done, the proposal, and below them the options.

    Where there is not room for all, what comes first goes last; each option keeps its edge.
    """
    nothing = _nothing(screen)
    card = [row for text, most in _card(screen.proposal) for row in wrapped(text, width, most)]
    options = [_option(option, width) for option in screen.options]
    above = wrapped(nothing.copy(), width, 3 if card else 4)
    free = height - len(above) - len(card) - len(options)
    if free < 0 and height - len(options) < len(above) + min(len(card), 2):
        rows = flowing((_button(option) for option in screen.options), width)
        room = height - len(rows) - min(len(card), 2)
        above = wrapped(nothing, width, min(max(room, 1), 3))
    else:
        rows = []
        for option in options:
            needs = wrapped(option, width, 1 + min(max(free, 0), 1), hang=_OPTION_HANG)
            free -= len(needs) - 1
            rows += needs
    room = height - len(rows)
    return [*filled([*above, *card], room), *rows]


def next_in_full(screen: Screen, width: int) -> list[Text]:
    """The same, of which nothing is cut."""
    texts = [_nothing(screen), *(text for text, _ in _card(screen.proposal))]
    options = [_option(option, width) for option in screen.options]
    return [row for text in (*texts, *options) for row in wrapped(text, width, hang=_OPTION_HANG)]


def _nothing(screen: Screen) -> Text:
    return Text(printable(screen.if_nothing), style=BOLD)


def _card(card: ProposalCard | None) -> Iterator[tuple[Text, int]]:
    """What is said of the proposal, each with the most rows that it may take."""
    if card is None:
        return
    answer = "  ⏎" if card.can_answer else ""
    yield told(card.title + answer, Tone.WORD if card.can_answer else Tone.PLAIN), 1
    if card.answered:
        yield told(card.answered, style=DIM), 1
    if card.veto_left_s is not None:
        yield _window(card.veto_left_s, card.veto_window_s or 0.0), 1
    yield from ((told(conflict, Tone.CAUTION), 1) for conflict in card.conflicts)
    yield joined(map(said, card.facts)), 2
    if card.runner_up:
        yield told(card.runner_up, style=DIM), 1


def _window(left_s: float, window_s: float) -> Text:
    full = round(min(max(left_s / window_s if window_s > 0 else 0.0, 0.0), 1.0) * _WINDOW_WIDTH)
    bar = "█" * full + "░" * (_WINDOW_WIDTH - full)
    return Text(f"goes ahead unless vetoed (⌫): {bar} {left_s:.1f} s", style=STYLES[Tone.WORD])


def _button(option: OptionRow) -> Text:
    """An option in few characters: its edge, its action, and what is found of it."""
    edge = edge_of(cue_of(option))
    before, after = _EDGES[edge]
    # What is free needs no word: it alone has no edge.
    kind = "" if option.kind is OptionKind.FREE else f" {_KINDS[option.kind]}"
    words = f"{before}{printable(option.action)}{kind}{after}"
    return Text(words, style=_EDGE_STYLES[edge])


def _option(option: OptionRow, width: int) -> Text:
    edge = edge_of(cue_of(option))
    before, after = _EDGES[edge]
    kind = _KINDS[option.kind]
    if option.kind is OptionKind.PROBLEMATIC:
        kind += f" {percent(option.severity)}"
    if width < _OPTION_WIDE:
        kind = "" if option.kind is OptionKind.FREE else f"{kind} "
    return Text.assemble(
        (f"{before} {printable(option.action)} {after} ", _EDGE_STYLES[edge]),
        (kind if width < _OPTION_WIDE else f"{kind:<11}", _EDGE_STYLES[edge]),
        joined([told(option.why), told(option.does, style=DIM)]),
    )


# --- on the way --------------------------------------------------------------------------------


def way_title(screen: Screen) -> str:
    """The title of the block, such as `on the way: 2`."""
    waiting = f", {screen.waiting} waiting here" if screen.waiting else ""
    return f"on the way: {screen.on_the_way or 'nothing'}{waiting}"


def way_rows(screen: Screen, width: int, height: int) -> list[Text]:
    """The commands, newest first: a row each, two of those on the way where there is room."""
    rows: list[Text] = []
    spare = height - sum(not row.is_over for row in screen.commands)
    for row, text in _commands(screen):
        most = 1 if row.is_over or spare < 1 else 2
        needs = wrapped(text, width, most, hang=_WAY_HANG)
        spare -= len(needs) - 1
        rows += needs
    return rows[:height]


def way_in_full(screen: Screen, width: int) -> list[Text]:
    """The same, of which nothing is cut."""
    return [row for _, text in _commands(screen) for row in wrapped(text, width, hang=_WAY_HANG)]


def _commands(screen: Screen) -> Iterator[tuple[CommandRow, Text]]:
    marks = {
        ghost.command: order_mark(index)
        for index, ghost in enumerate(screen.map.after)
        if ghost.command is not None
    }
    newest = newest_open(screen)
    for row in screen.commands:
        take_back = ""
        if row is newest:
            until_ns = row.take_back_until_ns
            left = "" if until_ns is None else f" {span_text(until_ns - screen.now_ns)} left"
            take_back = f"  [Esc{left}]"
        yield row, _command(row, marks.get(row.number, ""), take_back)


def newest_open(screen: Screen) -> CommandRow | None:
    """The newest command that can still be taken back, or given up."""
    return next((row for row in screen.commands if row.can_take_back or row.held is not None), None)


def _command(row: CommandRow, mark: str, take_back: str) -> Text:
    quiet = DIM if row.is_over else ""
    number = str(row.number) if row.number else "here"
    return Text.assemble(
        (f"{number} ", quiet or BOLD),
        (mark + " " if mark else "", "magenta"),
        told(row.text, style=quiet),
        (take_back, STYLES[Tone.WORD]),
        "  ",
        told(" · ".join(row.words), row.tone, style=quiet),
    )


# --- state -------------------------------------------------------------------------------------


def state_rows(screen: Screen, width: int, height: int) -> list[Text]:
    """Rover, failsafe, goals, link and model: a row each, and more where there is room."""
    goals = [told(goal.text, goal.tone) for goal in screen.goals] or [Text("none")]
    blocks = [
        ("ROVER", list(map(said, screen.rover))),
        ("FAILSAFE", list(map(said, screen.failsafe))),
        ("GOALS", goals),
        ("LINK", list(map(said, screen.link))),
        ("MODEL", list(map(said, screen.model))),
    ][:height]
    texts = [Text.assemble((f"{name:<9}", DIM), joined(parts)) for name, parts in blocks]
    needs = [len(wrapped(text.copy(), width, hang=9)) for text in texts]
    given = [1] * len(texts)
    for index in _more(needs):
        if sum(given) < height and given[index] < needs[index]:
            given[index] += 1
    return [
        row
        for text, most in zip(texts, given, strict=True)
        for row in wrapped(text, width, most, hang=9)
    ]


def _more(needs: list[int]) -> Iterator[int]:
    """Which block is to have the next row, in turns."""
    for _ in range(max(needs, default=0)):
        yield from range(len(needs))


# --- exercise, events --------------------------------------------------------------------------


def exercise_rows(screen: Screen, width: int, height: int) -> list[Text]:
    """The step of the exercise that comes next, and how it is done."""
    steps = screen.exercise
    done = sum(step.done for step in steps)
    step = next((step for step in steps if not (step.done or step.missed)), None)
    if step is None:
        said = f"exercise: {done} of {len(steps)} steps done ✓"
        return [line(told(said), width)][:height]
    text = Text.assemble(
        (f"exercise {done + 1}/{len(steps)} ", DIM),
        told(step.text, style=BOLD),
        (f": {printable(step.how)}", ""),
    )
    return wrapped(text, width, height, hang=2)


def exercise_in_full(screen: Screen, width: int) -> list[Text]:
    """Every step of the exercise, ticked if it was done."""
    rows = []
    for step in screen.exercise:
        text = Text.assemble(f"{step.mark} ", told(step.text, style=DIM if step.done else BOLD))
        if not step.done:
            text.append(f": {printable(step.how)}")
        rows += wrapped(text, width, hang=2)
    return rows


def event_rows(screen: Screen, width: int, height: int) -> list[Text]:
    """Alarms that wait for a word, then events that are not routine; newest first."""
    return [line(text, width) for text in list(_happened(screen, width, routine=False))[:height]]


def events_in_full(screen: Screen, width: int) -> list[Text]:
    """The alarms that wait for a word and all events, of which nothing is cut."""
    texts = _happened(screen, max(width, _WIDE), routine=True)
    return [row for text in texts for row in wrapped(text, width, hang=2)]


def _happened(screen: Screen, width: int, *, routine: bool) -> Iterator[Text]:
    yield from (_alarm(one, width) for one in screen.alarms if not one.acknowledged)
    yield from (_event(one, width) for one in screen.events if routine or not one.routine)


def _times(row: AlarmRow | EventRow, width: int) -> Text:
    learned = clock_text(row.learned_ns)
    if width < _WIDE:
        return Text(f"{learned} ", style=DIM)
    return Text(f"{clock_text(row.so_ns)} so, {learned} learned  ", style=DIM)


def _alarm(alarm: AlarmRow, width: int) -> Text:
    count = f" ({alarm.count} times)" if alarm.count > 1 else ""
    return Text.assemble(
        _times(alarm, width), told(f"{alarm.text}{count}", alarm.tone), ("  [x]", BOLD)
    )


def _event(event: EventRow, width: int) -> Text:
    quiet = DIM if event.routine else ""
    return Text.assemble(_times(event, width), told(event.text, event.tone, style=quiet))
