"""What an operator gives at the ground: an order at once, or a step of a sequence."""

import msgspec

from farside.messages import Order


class Planned(msgspec.Struct, frozen=True, omit_defaults=True, tag="planned"):
    """An order that is not to be begun at once.

    Attributes:
        order: the order.
        follows: whether it is to begin only once the order given before it is done.
        at_ns: it is not to begin before this time on the rover's clock.
        link_up: whether it stays at the ground until the link is up.
    """

    order: Order
    follows: bool = False
    at_ns: int | None = None
    link_up: bool = False


class Discard(msgspec.Struct, frozen=True, tag="discard"):
    """Give up what is held at the ground under this number; nothing of it was sent."""

    held: int


Act = Order | Planned | Discard
"""What an operator may give."""
