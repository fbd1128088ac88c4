"""Telemetry that cannot arrive now: it waits in the store, which is bounded, and nowhere else."""

from farside.frames import OutageReason
from farside.link import LinkConfig, LinkTerms, OneWay
from farside.link.endpoint.endpoint import rover_endpoint
from farside.link.profile.config import Blackout
from farside.messages import Heartbeat
from farside.node import NS_PER_S, Journal
from farside.rover.config import FailsafeConfig
from farside.rover.failsafe.silence import Silence
from farside.rover.telemetry import Reporting
from tests.ground.conftest import telemetry

CLEAR = OneWay(delay_s=0.0)


def test_in_a_gap_that_the_plan_foresees_nothing_piles_up_beside_the_store() -> None:
    """No heartbeat comes that would tell what has arrived; the gap may last for weeks."""
    gap = Blackout(start_s=60.0, end_s=1e6, reason=OutageReason.CONJUNCTION)
    terms = LinkTerms.simulated(LinkConfig(up=CLEAR, down=CLEAR, blackouts=(gap,)), seed=1)
    journal = Journal()
    endpoint = rover_endpoint(terms, journal)
    silence = Silence(FailsafeConfig(), terms)
    reporting = Reporting(endpoint, terms, silence, journal)
    for second in range(2000):
        now_ns = second * NS_PER_S
        if second < 60 and second % 2 == 0:
            silence.heard(now_ns)
            reporting.acknowledged(Heartbeat(0, now_ns - NS_PER_S, 0), now_ns)
        silence.look(now_ns)
        reporting.report(telemetry(float(second)))
        endpoint.take_sent()
        journal.take()
        assert len(reporting._unheard) < 20
    assert not silence.silent
    assert endpoint.store_state.kept > 1900
