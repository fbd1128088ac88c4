"""Whether both sides are one network after all, by a way round the link."""

from collections.abc import Callable

import zenoh


def watch_apart(
    rover: zenoh.Session, ground: zenoh.Session, joined: Callable[[], None]
) -> zenoh.LivelinessToken:
    """Have a token on one side, and see whether it shows on the other without having crossed.

    Where their routers know each other, what is delivered on one side comes back from the other, to
    be delivered again, without an end.

    Args:
        rover: a session with the one side.
        ground: a session with the other.
        joined: called, in a thread of Zenoh, when it shows.

    Returns:
        The token, which lasts as long as it is kept.
    """
    # Named so that no key expression with wildcards takes it across, and once for each link.
    key = f"@farside/apart/{ground.info.zid()}"

    def look(sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            joined()

    rover.liveliness().declare_subscriber(key, look, history=True)
    return ground.liveliness().declare_token(key)


def refuse_one_network(_time_ns: int) -> None:
    """Say that both sides are one.

    Raises:
        ConnectionError: always.
    """
    raise ConnectionError(
        "expected two Zenoh domains that do not know each other, found a way from one side to the "
        "other beside this link: is a router of one connected to one of the other?"
    )
