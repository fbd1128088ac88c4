"""The table of a profile that says where the other end is."""

from typing import Annotated

from msgspec import Meta

from farside.settings import Fraction, NonNegative, Section

BodyNumber = Annotated[int, Meta(ge=-1_000_000_000, le=1_000_000_000)]
"""A body's number in SPICE."""


class Ephemeris(Section, frozen=True):
    """Where the other end is: gives both delays, and outages around solar conjunction.

    Without `kernel` or `horizons` from astropy's built-in ephemeris, until the end of 2099.

    Attributes:
        body: the other end: `moon`, `mars` or another of `farside.link.profile.sky.sky.BODIES`;
            with `kernel` a NAIF number such as `-74` or a name; absent with `horizons`.
        epoch: the date at simulated time 0, in UTC, such as `2021-02-18T00:00:00Z`; in place of
            `start` of the link. Absent, it is that of a contact plan with dates.
        center: the body on which the ground is, likewise (project default: the Earth).
        kernel: path of a SPICE kernel of positions (SPK), or several whose orbits form a chain; the
            later ones count first. What they lack of Sun, Earth and planets is built in.
        horizons: path of a vector table as JPL Horizons prints it.
        conjunction_deg: no uplink while the angle between Sun and body, seen from `center`, is
            below this; 0 for never. 2.2 gives the command moratoria of NASA's Mars missions.
        conjunction_loss: probability that a downlink frame is lost in that time; a greater loss
            of the link itself stays.

    Raises:
        ValueError: if both `kernel` and `horizons` are given.
    """

    body: BodyNumber | str | None = None
    epoch: str | None = None
    center: BodyNumber | str = "earth"
    kernel: str | tuple[str, ...] = ()
    horizons: str | None = None
    conjunction_deg: NonNegative = 0.0
    conjunction_loss: Fraction = 0.5

    def __post_init__(self) -> None:
        if self.kernel and self.horizons is not None:
            raise ValueError("expected kernel or horizons, found both")
