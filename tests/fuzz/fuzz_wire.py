"""Fuzzes what takes bytes from the link: only `FrameError` may come out of it.

    pip install atheris
    python tests/fuzz/fuzz_wire.py -max_total_time=600

Arguments are those of libFuzzer; a directory keeps what it finds. Not part of `make test`, where
hypothesis does the same for a moment.
"""

import sys
import zlib
from collections.abc import Callable
from contextlib import suppress

import atheris  # type: ignore[import-untyped]

with atheris.instrument_imports(include=["farside.link"]):
    import msgspec

    from farside.control import CommandStage, Mode, OnLoss
    from farside.link.endpoint.fragments import Fragmenter, Reassembler
    from farside.link.endpoint.keys import simulated_key
    from farside.link.endpoint.receiver import ReliableReceiver
    from farside.link.endpoint.segments import ReceptionReport, decode_part, encode_part
    from farside.link.endpoint.sender import ReliableSender
    from farside.link.endpoint.transfer import TransferConfig
    from farside.link.endpoint.wire import (
        OVERHEAD_BYTE,
        WIRE_VERSION,
        Flag,
        FrameError,
        Opener,
        Sealer,
        unpack,
    )
    from farside.link.profile.config import LinkConfig, OneWay
    from farside.link.profile.schedule import Schedule
    from farside.messages import (
        Approve,
        Command,
        CommandReached,
        Downlink,
        Drive,
        Event,
        Heartbeat,
        LinkBack,
        Meant,
        ModelHeld,
        ModelUpdate,
        Proposal,
        ProposedStep,
        SetGoal,
        SetMode,
        SetOnLoss,
        Shown,
        Uplink,
        Veto,
    )
    from farside.node import Direction

_KEY = simulated_key(0)
_encode = msgspec.msgpack.encode
_UPLINK, _DOWNLINK = msgspec.msgpack.Decoder(Uplink), msgspec.msgpack.Decoder(Downlink)
_STEP = ProposedStep(("at:A", "facing:N"), "N", 2.5)
_MESSAGES = [
    (_UPLINK, b""),
    (_DOWNLINK, b""),
    (_UPLINK, _encode(Heartbeat())),
    (_UPLINK, _encode(Heartbeat(3, 9, 5, ModelHeld(7, 99, wants_whole=True)))),
    (_DOWNLINK, _encode(ModelUpdate(1, 9, 2, 99, bytes(20)))),
    (_UPLINK, _encode(Command(1, 99, Drive("N")))),
    (_UPLINK, _encode(Command(2, 99, SetMode(Mode.SHARED)))),
    (_UPLINK, _encode(Command(3, 99, SetGoal(("at:A", "facing:N"), 2.0)))),
    (_UPLINK, _encode(Command(4, 99, Drive("N", force=True), Meant(Mode.GUIDED, "at:A")))),
    (_UPLINK, _encode(Command(5, 99, Approve(1), Meant(Mode.SHARED, after=4)))),
    (_UPLINK, _encode(Command(6, 99, Veto(1)))),
    (_UPLINK, _encode(Command(7, 99, SetOnLoss(OnLoss.HOLD)))),
    (_UPLINK, _encode(Shown(1))),
    (_DOWNLINK, _encode(Proposal(1, 0, ("at:A",), "N", (_STEP, _STEP), veto_window_s=20.0))),
    (_DOWNLINK, _encode(Event(1, 9, CommandReached(1, CommandStage.EXPIRED, "late")))),
    (_DOWNLINK, _encode(Event(2, 9, LinkBack(99, 3, 1, (("at:A",), ("at:B",)))))),
]
_HELD_BYTE = 10_000
_WAY = OneWay(delay_s=1.3, rate_bit_s=8000)
_SCHEDULE = Schedule(LinkConfig(up=_WAY, down=_WAY))
_TRANSFER = TransferConfig(segment_byte=64, window=16)


def _with_crc(content: bytes) -> bytes:
    return content + zlib.crc32(content).to_bytes(4, "little")


def _raw_frames(data: atheris.FuzzedDataProvider) -> None:
    """Bytes from anyone: as they are, with a CRC that matches, and of our version."""
    opener = Opener(_KEY, Direction.UP)
    while data.remaining_bytes():
        wire = data.ConsumeBytes(data.ConsumeIntInRange(0, 80))
        for shape in (wire, _with_crc(wire), _with_crc(bytes((WIRE_VERSION,)) + wire)):
            with suppress(FrameError):
                opener.open(shape)
                raise AssertionError(f"opened what nobody sealed: {shape!r}")


def _changed_frames(data: atheris.FuzzedDataProvider) -> None:
    """Genuine frames, in any order, some of them changed."""
    sealer, opener = Sealer(_KEY, Direction.UP), Opener(_KEY, Direction.UP, window=8)
    frames = [sealer.seal(bytes((number,)) * number, Flag(number)) for number in range(16)]
    opened = set()
    while data.remaining_bytes():
        wire = frames[data.ConsumeIntInRange(0, 15)]
        at = data.ConsumeIntInRange(0, len(wire))
        wire = wire[:at] + data.ConsumeBytes(1) + wire[at + data.ConsumeIntInRange(0, 2) :]
        if data.ConsumeBool():
            wire = _with_crc(wire[:-4])
        with suppress(FrameError):
            sequence, flags, body = opener.open(wire)
            if wire not in frames or sequence in opened:
                raise AssertionError(f"opened what nobody sealed, or twice: {wire!r}")
            if (flags, body) != (sequence, bytes((sequence,)) * sequence):
                raise AssertionError(f"opened something else than was sealed: {wire!r}")
            opened.add(sequence)


def _messages(data: atheris.FuzzedDataProvider) -> None:
    """Genuine messages, changed in a few places: what a peer that has lost its mind says."""
    decoder, body = _MESSAGES[data.ConsumeIntInRange(0, len(_MESSAGES) - 1)]
    for _ in range(data.ConsumeIntInRange(0, 4)):
        at = data.ConsumeIntInRange(0, len(body))
        end = at + data.ConsumeIntInRange(0, 4)
        body = body[:at] + data.ConsumeBytes(data.ConsumeIntInRange(0, 6)) + body[end:]
    with suppress(FrameError):
        encoded = _encode(unpack(body, decoder))
        if _encode(unpack(encoded, decoder)) != encoded:
            raise AssertionError(f"unpacked differently the second time: {encoded!r}")


def _fragments(data: atheris.FuzzedDataProvider) -> None:
    """Fragments in any order, lost, repeated, made up."""
    reassembler = Reassembler(1000, max_messages=4, max_byte=_HELD_BYTE)
    fragmenter = Fragmenter(OVERHEAD_BYTE + 8 + 20)
    genuine = {number: bytes((number,)) * 70 for number in range(4)}
    bodies = [body for n, message in genuine.items() for body in fragmenter.cut(message, n)]
    now_ns = 0
    while data.remaining_bytes():
        now_ns += data.ConsumeIntInRange(0, 300)
        body = bodies[data.ConsumeIntInRange(0, len(bodies) - 1)]
        if data.ConsumeBool():
            # Of other messages: those of a genuine one must come out as they went in.
            body = bytes((1,)) + data.ConsumeBytes(data.ConsumeIntInRange(0, 60))
        with suppress(FrameError):
            message = reassembler.add(body, now_ns)
            if message is not None and body[0] == 0 and message not in genuine.values():
                raise AssertionError(f"put together what nobody cut: {message!r}")
        if not 0 <= reassembler.held_byte <= _HELD_BYTE:
            raise AssertionError(f"holds {reassembler.held_byte} bytes")


def _segments(data: atheris.FuzzedDataProvider) -> None:
    """Segments and reports of the reliable service, changed in a few places, in any order."""
    sender = ReliableSender(Direction.DOWN, _SCHEDULE, _TRANSFER)
    receiver = ReliableReceiver(Direction.DOWN, _SCHEDULE, _TRANSFER)
    sender.offer(bytes(range(200)))
    now_ns = 0
    bodies = [encode_part(ReceptionReport(10**9, 1, 0, (1, 1), rest=True))]
    while data.remaining_bytes():
        now_ns += data.ConsumeIntInRange(0, 5 * 10**9)
        if sending := sender.take(now_ns):
            bodies.append(sending.payload)
        bodies += receiver.take(now_ns)
        body = bodies[data.ConsumeIntInRange(0, len(bodies) - 1)]
        at = data.ConsumeIntInRange(0, len(body))
        changed = data.ConsumeBytes(data.ConsumeIntInRange(0, 3))
        with suppress(FrameError):
            part = decode_part(body[:at] + changed + body[at + len(changed) :])
            if isinstance(part, ReceptionReport):
                sender.receive(part, now_ns)
            else:
                receiver.receive(part, now_ns)


_LAYERS: list[Callable[[atheris.FuzzedDataProvider], None]] = [
    _raw_frames,
    _changed_frames,
    _messages,
    _fragments,
    _segments,
]


def _fuzz(taken: bytes) -> None:
    data = atheris.FuzzedDataProvider(taken)
    _LAYERS[data.ConsumeIntInRange(0, len(_LAYERS) - 1)](data)


if __name__ == "__main__":
    atheris.Setup(sys.argv, _fuzz)
    atheris.Fuzz()
