"""What the motors do when a hand moves: the same cue by force and by rumble as on the screen."""

import ctypes
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest
from virtual_stick import options

from farside.console.stick.cues import cue_of, edge_of
from farside.console.stick.intention import Felt, Intention, Situation
from farside.console.stick.sdl import Haptic, load
from farside.console.stick.sinks import ForceSink, RumbleSink
from farside.ground.view.view import OptionKind

POLL_NS = 8_000_000


class Recorder:
    """Motors that write down what they are told."""

    def __init__(self) -> None:
        self.now_ms = 0
        self.rumbles: list[tuple[int, float]] = []
        self.springs: list[tuple[float, float, float]] = []
        self.constants: list[tuple[float, float, float]] = []

    def rumble(self, strength: float, for_ms: int) -> None:  # noqa: ARG002 - as of real motors
        self.rumbles.append((self.now_ms, strength))

    def spring(self, level: float, x: float, y: float) -> None:
        self.springs.append((level, x, y))

    def constant(self, level: float, x: float, y: float) -> None:
        self.constants.append((level, x, y))


def moved(kind: str, path: Iterator[float]) -> Recorder:
    """What the motors are told while a hand goes along this path to an option in the east."""
    recorder, intention = Recorder(), Intention()
    sinks = RumbleSink(recorder), ForceSink(recorder)
    for number, x in enumerate(path):
        recorder.now_ms = 8 * number
        now_ns = POLL_NS * number
        felt = intention.move(now_ns, x, 0.0, Situation(options(E=kind))).felt
        for sink in sinks:
            sink.play(felt, now_ns)
    return recorder


def slowly() -> Iterator[float]:
    """At rest for 0.8 s, nearer in a second, and back at once."""
    yield from [0.0] * 100
    yield from (0.2 + 0.5 * step / 125 for step in range(1, 126))
    yield 0.0


def by_rumble(rumbles: list[tuple[int, float]]) -> str:
    levels = [level for _, level in rumbles]
    starts = sum(before == 0 < level for before, level in zip([0.0, *levels], levels, strict=False))
    if len(set(levels)) > 5:
        return "vibration that rises"
    return {0: "nothing", 1: "one pulse", 2: "two pulses"}[starts]


def by_force(recorder: Recorder) -> str:
    levels = [level for level, _, _ in recorder.constants]
    if levels:
        assert min(levels) == -max(levels)
        return "vibration that rises"
    places = {(x > 0, level > 0.5) for level, x, _ in recorder.springs if level}
    return {(): "nothing", ((False, True),): "held back", ((True, False),): "drawn there"}[
        tuple(places)
    ]


@pytest.mark.parametrize(
    ("kind", "edge", "rumble", "force"),
    [
        ("free", "plain", "nothing", "nothing"),
        ("invalid", "barred", "two pulses", "held back"),
        ("problematic", "hatched", "vibration that rises", "vibration that rises"),
        ("proposed", "lit", "one pulse", "drawn there"),
    ],
)
def test_the_same_situation_gives_the_same_cue_on_all_three(
    kind: str, edge: str, rumble: str, force: str
) -> None:
    shown = {row.action: edge_of(cue_of(row)) for row in options(E=kind)}
    recorder = moved(kind, slowly())
    # A proposal is felt when it comes, too.
    came = by_rumble([told for told in recorder.rumbles if told[0] < 800])
    assert came == ("one pulse" if kind == "proposed" else "nothing")

    nearing = [told for told in recorder.rumbles if told[0] >= 800]
    assert (shown["E"], by_rumble(nearing), by_force(recorder)) == (edge, rumble, force)


def test_two_short_pulses_are_as_long_as_the_table_says() -> None:
    recorder = moved("invalid", iter([0.0, *[0.5] * 125]))

    assert recorder.rumbles == [(8, 1.0), (88, 0.0), (168, 1.0), (248, 0.0)]


def test_a_rumble_that_lasts_is_renewed_before_it_ends_by_itself() -> None:
    recorder = moved("problematic", iter([0.5] * 250))
    times = [told_ms for told_ms, _ in recorder.rumbles]

    assert len({level for _, level in recorder.rumbles}) == 1
    assert max(b - a for a, b in pairwise(times)) < 600


def test_nothing_is_told_twice() -> None:
    recorder = moved("invalid", iter([0.5] * 100))

    assert recorder.springs == [(1.0, 0.0, 0.0)]


class Wheel:
    """A device with force feedback, as SDL2 would drive it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, can: tuple[int, ...]) -> None:
        self.sdl: Any = load()
        self.effects: dict[int, Any] = {}
        self.can = can
        self.closed = False
        for name, does in {
            "OpenFromJoystick": lambda _: 1,
            "NewEffect": self._new,
            "UpdateEffect": self._update,
            "RunEffect": lambda *_: 0,
            "Close": self._close,
        }.items():
            monkeypatch.setattr(self.sdl, f"SDL_Haptic{name}", does)

    def _new(self, _: object, effect: Any) -> int:
        kind = int(effect._obj.type)
        return self._update(None, kind, effect) if kind in self.can else -1

    def _update(self, _: object, number: int, effect: Any) -> int:
        self.effects[number] = type(effect._obj).from_buffer_copy(bytes(effect._obj))
        return number

    def _close(self, _: object) -> None:
        self.closed = True


def felt(kind: str, near: float) -> Felt:
    north = options(N=kind)[0]
    return Felt("N", cue_of(north), near, 0)


def test_a_stick_with_force_feedback_is_told_in_its_own_terms(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """SDL's y points to whoever holds the stick, so what lies north has a negative one."""
    sdl = load()
    wheel = Wheel(monkeypatch, can=(sdl.SDL_HAPTIC_SPRING, sdl.SDL_HAPTIC_CONSTANT))
    haptic = Haptic.of(sdl, None)
    sink = ForceSink(haptic)

    sink.play(felt("proposed", 0.0), 0)
    spring = wheel.effects[sdl.SDL_HAPTIC_SPRING].condition
    assert (spring.center[0], spring.center[1] < -10000) == (0, True)
    assert 0 < spring.right_coeff[1] == spring.left_coeff[1] < 16000
    assert spring.length == ctypes.c_uint32(sdl.SDL_HAPTIC_INFINITY).value

    sink.play(felt("problematic", 1.0), 0)
    constant = wheel.effects[sdl.SDL_HAPTIC_CONSTANT].constant
    assert constant.level > 10000
    assert tuple(constant.direction.dir)[:2] == (0, 1)
    assert wheel.effects[sdl.SDL_HAPTIC_SPRING].condition.right_coeff[1] == 0

    haptic.close()
    assert wheel.closed


def test_a_device_that_has_no_spring_is_left_to_its_rumble(monkeypatch: pytest.MonkeyPatch) -> None:
    sdl = load()
    wheel = Wheel(monkeypatch, can=(sdl.SDL_HAPTIC_CONSTANT,))

    assert Haptic.of(sdl, None) is None
    assert wheel.closed


def test_every_kind_of_option_is_tried_above() -> None:
    assert {kind.value for kind in OptionKind} == {"free", "invalid", "problematic", "proposed"}
