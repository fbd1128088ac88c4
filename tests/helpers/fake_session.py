"""A session without a run behind it, which notes what it was asked to do."""

from farside.console.pacing import Until
from farside.console.screen.screen import AlarmRow, Tone
from farside.console.session import Session
from farside.control import Mode, OnLoss
from farside.messages import Tokens
from farside.node import to_ns

LIGHT_NS = to_ns(1.28)
START_NS = to_ns(600.0)


class FakeSession(Session):
    """Notes what it was asked to do.

    Attributes:
        asked: what it was asked to do, in order, such as `approve 14`.
    """

    def __init__(self) -> None:
        super().__init__("blackout", to_ns(1200.0))
        self.asked: list[str] = []
        self.now_ns = START_NS + to_ns(10.5)
        self.mode = Mode.SHARED
        self.number = 14
        self.answers: dict[int, str] = {}
        self.taken_back: set[int] = set()
        self.goals = ["B", "C"]
        self.heat = False
        self.looked_at: str | None = None
        self.over = ""
        self.veto_window_s: float | None = None
        self.alarms = {
            1: AlarmRow(1, START_NS, START_NS + LIGHT_NS, "battery below the reserve", 2),
            2: AlarmRow(2, START_NS + 1, START_NS + LIGHT_NS, "blocked at 3,4", 1, Tone.CAUTION),
        }

    def _ask(self, words: str, answer: str = "") -> str:
        self.asked.append(words)
        return answer or words

    def choose(self, action: str, *, insist: bool = False) -> str:
        if action == "S" and not insist:
            return self._ask("choose S", "not ordered: S meets a wall here; insist with Shift")
        return self._ask(f"choose {action}{' insist' if insist else ''}")

    def approve(self, proposal: int) -> str:
        self.answers[proposal] = "approved by command 95, begins in 1.3 s"
        return self._ask(f"approve {proposal}")

    def veto(self, proposal: int) -> str:
        self.answers[proposal] = "vetoed by command 95"
        return self._ask(f"veto {proposal}")

    def take_back(self, number: int | None = None) -> str:
        self.taken_back.add(number or 0)
        return self._ask(f"take back {number}")

    def discard(self, held: int) -> str:
        return self._ask(f"discard {held}")

    def set_goal(self, place: str, priority: float | None = None) -> str:
        if place == "nowhere":
            return self._ask("goal nowhere", "not ordered: no place is called nowhere")
        self.goals.insert(0, place)
        return self._ask(f"goal {place} {priority}")

    def withdraw_goal(self, tokens: Tokens) -> str:
        self.goals.remove(tokens[0].removeprefix("at:"))
        return self._ask(f"withdraw {tokens[0]}")

    def set_mode(self, mode: Mode) -> str:
        self.mode = mode
        return self._ask(f"mode {mode}")

    def set_on_loss(self, on_loss: OnLoss) -> str:
        return self._ask(f"on loss {on_loss}")

    def pause(self) -> str:
        return self._ask("pause", super().pause())

    def set_speed(self, speed: float) -> str:
        return self._ask(f"speed {speed:g}", super().set_speed(speed))

    def faster(self) -> str:
        return self._ask("faster", super().faster())

    def slower(self) -> str:
        return self._ask("slower", super().slower())

    def warp(self, until: Until) -> str:
        self.pacing.warp(until)
        return self._ask(f"warp until {until}")

    def look_at(self, place: str | None) -> None:
        self.looked_at = place

    def show_heat(self, shown: bool) -> None:
        self.heat = shown
        self._ask(f"heat {shown}")

    def acknowledge(self, alarm: int | None = None) -> str:
        for number in [alarm] if alarm else list(self.alarms):
            self.alarms.pop(number, None)
        return self._ask(f"acknowledge {alarm}")

    def read(self) -> None:
        self._ask("read")
