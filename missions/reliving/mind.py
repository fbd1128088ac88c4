"""What the model on board holds at a moment, in sentences: for `farside why`."""

from collections.abc import Iterator

from farside.dem import Goal, Why
from farside.logs import sign_text
from farside.logs.story.sentences import arc_text
from farside.places import ACTIONS
from farside.rover.controller import Controller
from farside.rover.node import Rover
from farside.topics import Arc

_LEAST_CHANCE = 0.001
_STEPS = 12  # of the policy path, beyond which the rest is counted


def mind_of(rover: Rover) -> Iterator[str]:
    """Its goals, what it would choose and on what grounds, its path, what it expects here."""
    model = rover.controller
    for goal in model.goals:
        yield f"goal {_goal(goal)}"
    if not model.goals:
        yield "no goal on the Goal List"
    why = model.why()
    if why is not None:
        yield f"towards the top-goal it would take {why.action}: {_arc(why)}"
        if why.runner_up is not None:
            yield f"the runner-up is {_arc(why.runner_up)}, {why.margin:.1f} s dearer"
    elif model.goals:
        yield "it knows no way to a goal from the active Signs"
    yield from _path(model)
    yield from _expected(model)
    yield (
        f"{model.sign_count} Signs, {model.hypothesis_count} hypotheses, "
        f"mean C_m {model.mean_cm:.2f}"
    )


def _goal(goal: Goal) -> str:
    text = f"{sign_text(goal.tokens)}, priority {goal.priority:.3g}"
    return text if goal.aside is None else f"{text}, put aside: {goal.aside}"


def _arc(why: Why) -> str:
    return arc_text(Arc(why.context, why.action, why.outcome, why.cm, why.cost_to_go))


def _path(model: Controller) -> Iterator[str]:
    path = model.policy_path()
    if not path:
        return
    ways = " ".join(step.action for step in path[:_STEPS])
    more = f" and {len(path) - _STEPS} more" if len(path) > _STEPS else ""
    chance = path[-1].probability
    at_once = f"{chance:.1%}" if chance >= _LEAST_CHANCE else f"less than {_LEAST_CHANCE:.1%}"
    yield (
        f"its policy path: {ways}{more}; cost to go {path[0].cost_to_go:.1f} s, "
        f"probability that every step succeeds at once {at_once}"
    )


def _expected(model: Controller) -> Iterator[str]:
    for action in ACTIONS:
        known = model.expected(action)
        if known is not None:
            arc = Arc(known.context, action, known.outcome, known.cm, None)
            yield f"of {action} it expects {arc_text(arc)}"
