"""The controller that takes its actions from outside."""

import numpy as np
import pytest

from farside.dem import Choice
from farside.places import ACTIONS
from farside.rover.control.queued import QueuedController


def test_what_is_put_is_chosen_once_and_only_with_a_goal() -> None:
    queue = QueuedController(dict.fromkeys(ACTIONS, 1.0), rng=np.random.default_rng(0))
    queue.put("N")
    assert (queue.choose(), queue.is_asked) == (None, False)
    queue.set_goal(["at:A"], 1.0)
    assert (queue.choose(explore=False), queue.is_asked) == (None, False)
    assert (queue.choose(), queue.is_asked) == (Choice("N"), False)
    assert (queue.choose(), queue.is_asked) == (None, True)
    queue.put("E")
    queue.put("W")
    assert (queue.is_asked, queue.choose()) == (False, Choice("W"))
    queue.put("S")
    queue.put(None)
    assert queue.choose() is None


def test_what_is_no_action_is_refused() -> None:
    queue = QueuedController({"N": 1.0, "S": 1.0}, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="expected one of the actions N, S, found 'E'"):
        queue.put("E")
