"""The reliable service: messages cut into segments, and reports of which have arrived.

Selective-repeat ARQ for links where a round trip may outlast a contact; the two ends are
`farside.link.endpoint.sender` and `farside.link.endpoint.receiver`. Three rules keep it from
stalling and from flooding the link:

- A segment is retransmitted only when a report made after its expected arrival lacks it, so
  nothing is repeated before its reply could have come.
- Reply deadlines follow from the schedule: time to leave, light time there, reporting interval,
  wait for a contact, light time back. Outside contacts no timer runs (as in LTP, RFC 5326) and
  nothing is sent.
- When a reply is overdue, something happened that no schedule foresaw. Segments then go out as
  single probes, oldest first, which take a tenth of the rate, counted in open time only.

A link may be open for less than a round trip at a time, again and again. Then nothing that is sent
upon hearing the other end arrives in time. So the waits between probes keep time with no period, a
segment is reported at once where possible, and reports that go unheard are repeated like probes.

Both ends know the time and the schedule. Whatever they are handed has passed an integrity check.
"""

from typing import Annotated

from msgspec import Meta

from farside.settings import Count, NonNegative, Section


class TransferConfig(Section, frozen=True):
    """Settings of the reliable service; the same at both ends.

    Attributes:
        segment_byte: the most data in a segment, and the longest report (project default: 1000).
            An encoded segment is up to 24 bytes longer.
        window: how far the newest segment may be ahead of the oldest unacknowledged one, and how
            many segments a message may have (project default: 4096). It should hold what the
            rate lets through until the first reply can come.
        margin_s: by how much a segment or a reply may be late, for example because of jitter or
            frames sent first (project default: 1 s).
        keeps_on: whether new segments are sent although replies are overdue. On for sparse
            messages, which may get through though replies do not; off, nothing new is risked.
        spare: extra copies allowed, as a share of all segments, where another loss would cost
            another contact (project default: 0.3).
        repeats: how often a report is repeated, lest it was lost (project default: 3).
    """

    segment_byte: Annotated[int, Meta(ge=64)] = 1000
    window: Count = 4096
    margin_s: NonNegative = 1.0
    spare: NonNegative = 0.3
    keeps_on: bool = False
    repeats: Count = 3
