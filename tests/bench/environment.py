"""How many steps a second an agent gets from a mission as a gymnasium environment.

An agent acts at random for a while; its steps are counted by the processor's time, with the resets
that fall due, in the ticks of the mission and in coarse ones. A step on board is a move, with a
simulated time of its own, so simulated seconds a second stand beside.
"""

import time
from statistics import median

import gymnasium
from rich.console import Console
from rich.progress import track
from rich.table import Table

import farside.gymnasium

ROUNDS = 5
STEPS = 300
MISSIONS = ("blackout", "teach", "mars-relay")
TICKS_S = (None, 0.2)


def measured(name: str, seat: str, tick_s: float | None, seed: int) -> tuple[float, float, float]:
    """Steps a second, simulated seconds a second, and milliseconds of a reset."""
    overrides = {} if tick_s is None else {"tick_s": tick_s}
    env = gymnasium.make(f"farside/{name}-v0", seat=seat, overrides=overrides)
    began_s = time.process_time()
    _, info = env.reset(seed=seed)
    reset_s = time.process_time() - began_s
    env.action_space.seed(seed)
    simulated_s, since_s = 0.0, info["time_s"]
    began_s = time.process_time()
    for _ in range(STEPS):
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        if terminated or truncated:
            simulated_s += info["time_s"] - since_s
            since_s = env.reset()[1]["time_s"]
    simulated_s += info["time_s"] - since_s
    taken_s = time.process_time() - began_s
    return STEPS / taken_s, simulated_s / taken_s, 1000 * reset_s


def main() -> None:
    """Measure, and print the table."""
    assert set(MISSIONS) <= set(farside.gymnasium.MISSIONS)
    console = Console()
    table = Table("mission", "seat", "tick, s", "steps/s", "x real time", "reset, ms")
    rows = [
        (name, seat, tick_s)
        for name in MISSIONS
        for seat in ("rover", "ground")
        for tick_s in (TICKS_S if name != "mars-relay" else (None,))
    ]
    for name, seat, tick_s in track(rows, "measuring", console=console):
        rounds = [measured(name, seat, tick_s, seed) for seed in range(1, ROUNDS + 1)]
        figures = [f"{median(column):,.0f}" for column in zip(*rounds, strict=True)]
        table.add_row(name, seat, "its own" if tick_s is None else f"{tick_s:g}", *figures)
    console.print(table)


if __name__ == "__main__":
    main()
