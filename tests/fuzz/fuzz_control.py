"""Fuzzes the control query: it is taken or refused with a `ValueError`, and messages pass after it.

    pip install atheris
    PYTHONPATH=tests/helpers python tests/fuzz/fuzz_control.py -max_total_time=600

Arguments are those of libFuzzer; a directory keeps what it finds. Not part of `make test`, where
hypothesis does the same for a moment.
"""

import sys

import atheris  # type: ignore[import-untyped]
from hypothesis import given

with atheris.instrument_imports(include=["farside.link", "farside.validation"]):
    from changing_links import DELAYED, change, changes, live_through

    from farside.link.emulator import Emulator
    from farside.node import NEVER_NS, Direction

_fuzz_stories = given(changes)(live_through).hypothesis.fuzz_one_input  # type: ignore[attr-defined]

_PAYLOADS = [
    b'{"down": {"loss": 0.2, "jitter": {"spread_s": 0.1, "correlation": 0.5}}}',
    b'{"both": {"out": true, "loss": {"model": "gilbert-elliott", "p": 0.1, "r": 0.3}}}',
    b'{"up": {"rate_trace": {"times_ms": [0, 4, 4, 9]}}, "down": {"rate_bit_s": 800}}',
    b'{"up": {"delay_table": [{"t_s": 0, "delay_s": 1}, {"t_s": 9, "delay_s": 2}]}}',
    b'{"up": {"rate_table": [{"t_s": 0, "rate_bit_s": 0}], "queue_byte": 1, "drop": "oldest"}}',
    b'{"up": {"slots": {"min_s": 0.1, "max_s": 1, "frames": 2}, "lifetime_s": 0.5}}',
    b'{"changes": [{"at_s": 1, "loss": 0.5, "direction": "up"}, {"at_s": 2, "rate_bit_s": 9}]}',
    b'{"blackouts": [{"start_s": 0, "end_s": 1}], "seed": 3}',
    b'{"passes": {"length_s": 1, "period_s": 9}}',
    b'{"preset": "earth-geo", "down": {"reorder": {"share": 0.5, "hold_s": 1}, "jitter": null}}',
    b'{"both": {"bit_error_rate": 0.001, "bit_errors": "flip", "corrupt": 1, "duplicate": 1}}',
]


def _changed_payloads(data: atheris.FuzzedDataProvider) -> None:
    """Payloads changed in a few places, one after another, with messages in between."""
    subject: Emulator[int] = Emulator(DELAYED)
    now_ns = 0
    while data.remaining_bytes():
        payload = _PAYLOADS[data.ConsumeIntInRange(0, len(_PAYLOADS) - 1)]
        for _ in range(data.ConsumeIntInRange(0, 3)):
            at, length = data.ConsumeIntInRange(0, len(payload)), data.ConsumeIntInRange(0, 4)
            inserted = data.ConsumeBytes(data.ConsumeIntInRange(0, 8))
            payload = payload[:at] + inserted + payload[at + length :]
        change(subject, payload)
        for direction in Direction:
            subject.send(direction, now_ns, bytes(data.ConsumeIntInRange(0, 5000)), 0)
        endless = subject.ahead.latest_ns < NEVER_NS
        now_ns += data.ConsumeIntInRange(0, 10**9 if endless else 10**13)
        subject.advance(now_ns)


def _fuzz(taken: bytes) -> None:
    if taken[:1] < b"\x80":
        _fuzz_stories(taken[1:])
    else:
        _changed_payloads(atheris.FuzzedDataProvider(taken[1:]))


if __name__ == "__main__":
    atheris.Setup(sys.argv, _fuzz)
    atheris.Fuzz()
