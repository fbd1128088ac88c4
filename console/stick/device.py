"""A stick at this host: polled in a thread of its own, felt at once, and its orders handed in.

What is felt comes from the options that were last seen at the station. A second thread looks there
and hands in what was ordered, so that a busy station never makes a hand wait for its cue.
"""

import threading
import time
from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Protocol, Self

from farside.console.screen.screen import Screen
from farside.console.stick.intention import (
    Approve,
    Button,
    Choose,
    Intention,
    Order,
    Situation,
    Veto,
    situation_of,
)
from farside.console.stick.sdl import Key, Polled, StickError, Sticks, load
from farside.console.stick.seat import AmongSeats, StickSeat
from farside.console.stick.sinks import ForceSink, Sink

POLL_MS = 8
"""Wall time between two polls where nothing moves: 125 a second, so pulses have their length."""

LOOK_S = 0.1
"""Wall time between two looks at the station: as often as it looks at the run itself."""

_NONE = "stick: none found on this host; plug one in at any time, or use the keys"
_CHANGED = "not ordered: the options changed meanwhile; look, and choose again"
_BUTTONS = {Key.A: Button.APPROVE, Key.B: Button.VETO}


class InSession(Protocol):
    """What a stick needs of `farside.console.session.Session`."""

    def screen(self) -> Screen:
        """What is shown now."""
        ...

    def choose(self, action: str, *, insist: bool = False) -> str:
        """Choose an action."""
        ...

    def approve(self, proposal: int) -> str:
        """Approve a proposal."""
        ...

    def veto(self, proposal: int) -> str:
        """Veto a proposal."""
        ...


class AtStation(Protocol):
    """What a stick needs of `farside.console.station.Station`."""

    def do(self, what: Callable[[InSession], str]) -> str:
        """Have something done with the session."""
        ...

    def screen(self) -> Screen:
        """What is shown now."""
        ...


class HostStick:
    """The stick of this host, while it is entered as a context.

    Args:
        station: where its orders go, and its options come from.
        seats: who may order; `None` where nobody else can.
        say: is handed every line for the person, from threads of the stick's own.
        now_ns: wall time in nanoseconds, from any origin.
    """

    def __init__(
        self,
        station: AtStation,
        seats: AmongSeats | None,
        *,
        say: Callable[[str], None],
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._station, self._say, self._now_ns = station, say, now_ns
        self._seat = StickSeat(seats)
        self._situation = Situation()
        self._tasks: SimpleQueue[Callable[[], str]] = SimpleQueue()
        self._over = threading.Event()
        self._threads = [
            threading.Thread(target=work, name=f"stick {what}", daemon=True)
            for what, work in (("polling", self._poll), ("clerk", self._clerk))
        ]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._tasks.put(str)  # nothing to say: it wakes the clerk
        for thread in self._threads:
            thread.join()

    # --- polling: nothing here waits for anybody -----------------------------------------------

    def _poll(self) -> None:
        try:
            sticks = Sticks(load())
        except StickError as error:
            self._say(f"stick: {error}")
            return
        try:
            self._follow(sticks)
        finally:
            sticks.close()

    def _follow(self, sticks: Sticks) -> None:
        intention, known = Intention(), (0, "")
        if not sticks.name:
            self._say(_NONE)
        while not self._over.is_set():
            polled = sticks.poll(POLL_MS)
            if known != (sticks.opened, sticks.name):
                intention, known = Intention(), (sticks.opened, sticks.name)
                self._tell_of(sticks)
            if polled is not None:
                self._turn(intention, polled, sticks.sinks)

    def _tell_of(self, sticks: Sticks) -> None:
        """A stick came or went."""
        if sticks.name:
            self._say(_greeting(sticks))
        else:
            self._say("stick: unplugged; plug one in at any time, or use the keys")
            self._tasks.put(self._seat.leave)

    def _turn(self, intention: Intention, polled: Polled, sinks: tuple[Sink, ...]) -> None:
        now_ns, situation = self._now_ns(), self._situation
        readings = [intention.move(now_ns, polled.x, polled.y, situation)]
        for sink in sinks:
            sink.play(readings[0].felt, now_ns)
        for key in polled.pressed:
            if key is Key.START:
                self._tasks.put(self._seat.take_or_give)
            else:
                readings.append(intention.press(now_ns, _BUTTONS[key], situation))
        for reading in readings:
            if reading.note:
                self._say(reading.note)
            if reading.order is not None:
                self._tasks.put(partial(self._hand_in, reading.order, situation))

    # --- the clerk: looks, and hands in --------------------------------------------------------

    def _clerk(self) -> None:
        while not self._over.is_set():
            self._situation = situation_of(self._station.screen())
            try:
                said = self._tasks.get(timeout=LOOK_S)()
            except Empty:
                said = self._seat.news()
            if said:
                self._say(said)
        self._seat.leave()

    def _hand_in(self, order: Order, situation: Situation) -> str:
        if not self._seat.is_held():
            return "not ordered: a page commands now; Start asks it to hand over"
        return self._station.do(partial(_give, order=order, situation=situation))


def _give(session: InSession, order: Order, situation: Situation) -> str:
    """Give an order that was made for this situation; what to tell the person."""
    if situation_of(session.screen()).meaning != situation.meaning:
        return _CHANGED
    match order:
        case Choose(action, insist):
            return session.choose(action, insist=insist)
        case Approve(proposal):
            return session.approve(proposal)
        case Veto(proposal):
            return session.veto(proposal)


def _greeting(sticks: Sticks) -> str:
    """What a person is told of a stick that was found."""
    if not sticks.sinks:
        felt = "it has no motors, so its cues are on the screen only"
    elif isinstance(sticks.sinks[0], ForceSink):
        felt = "its cues are felt as force"
    else:
        felt = "its cues are felt as rumble"
    return (
        f"stick: {sticks.name}: the left stick chooses, A approves, B vetoes, "
        f"Start takes command or hands it over; {felt}"
    )
