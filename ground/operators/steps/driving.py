"""Driving by commands, one move at a time."""

from farside.control import CommandStage
from farside.ground.config import Tour
from farside.ground.operators.seat import Seat, Work
from farside.messages import Drive
from farside.places import Cell


def tour(seat: Seat, step: Tour) -> Work:
    """Drive from place to place."""
    for place in step.places:
        yield from drive_to(seat, seat.chart.places[place])


def drive_to(seat: Seat, target: Cell, *, charging: bool = True) -> Work:
    """Move and wait until the rover is known to be at a place.

    A drive that was refused is insisted on; unless the battery is low, when the rover is charged
    first, with `charging`.
    """
    goal = f"the rover to be at {seat.name(target)}"
    insist = False
    while True:
        way = _way(seat, target, goal)
        if way is None:
            yield ()
            continue
        if not way:
            return
        end = yield from seat.tell(Drive(way[0], force=insist))
        insist = end is not None and end.stage is CommandStage.REFUSED
        if insist and charging and seat.is_low and seat.chart.dock is not None:
            yield from charge(seat, seat.chart.dock)
            insist = False


def charge(seat: Seat, dock: Cell) -> Work:
    """Drive to the dock, and wait there until the rover is charged."""
    yield from drive_to(seat, dock, charging=False)
    while seat.is_low:
        seat.wait_for("the rover to be charged")
        yield ()


def _way(seat: Seat, target: Cell, goal: str) -> list[str] | None:
    """The path from where the rover stands, or `None` while that is not known for sure."""
    cell = seat.standing(goal)
    if cell is None:
        return None
    try:
        way = seat.chart.way(cell, target)
    except ValueError:
        # Where noise puts the rover behind a wall.
        seat.wait_for(f"{goal}, to which no way leads from where it believes to be")
        return None
    seat.wait_for(goal)
    return way
