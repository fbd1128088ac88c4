"""Mission keys and sequence numbers on disk: no number is used twice with one key, ever."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.link.endpoint import wire
from farside.link.endpoint.keys import (
    KeyFileError,
    SequenceFile,
    Use,
    create_key,
    read_key,
    simulated_key,
)
from farside.link.endpoint.wire import (
    SEQUENCE_LIMIT,
    FrameError,
    Opener,
    Sealer,
    SequenceExhaustedError,
)
from farside.node import Direction

UP, DOWN = Direction.UP, Direction.DOWN
KEY = simulated_key(7)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file of sequence numbers for a key that has not been used yet."""
    path = tmp_path / "up.sent"
    SequenceFile.create(path, KEY, UP, Use.SENT)
    return path


# --- keys --------------------------------------------------------------------------------------


def test_a_seed_always_gives_the_same_key() -> None:
    assert simulated_key(7).hex().startswith("fa78cebf3768538f")
    assert len({simulated_key(seed) for seed in (0, 1, 7, 2**80)}) == 4


def test_a_key_file_is_for_its_owner_alone_and_read_as_written(tmp_path: Path) -> None:
    path = tmp_path / "mission.key"
    key = create_key(path)

    assert path.read_text() == f"farside mission key 1\n{key.hex()}\n"
    assert path.stat().st_mode & 0o777 == 0o600
    assert read_key(path) == key
    assert create_key(tmp_path / "other.key") != key


def test_a_key_file_is_never_written_over(tmp_path: Path) -> None:
    path = tmp_path / "mission.key"
    key = create_key(path)

    with pytest.raises(KeyFileError, match="expected no key file there yet"):
        create_key(path)
    assert read_key(path) == key


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o644, 0o777])
def test_a_key_that_others_may_read_is_refused(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "mission.key"
    create_key(path)
    path.chmod(mode)

    with pytest.raises(KeyFileError, match=rf"for its owner alone, found mode {mode:04o}"):
        read_key(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"farside mission key 1\n" + b"0" * 63 + b"\n",
        b"farside mission key 1\n" + b"0" * 64 + b"\nmore",
        b"farside mission key 2\n" + b"0" * 64 + b"\n",
        b"\xff" * 200,
        b"0" * 10_000,
    ],
    ids=["empty", "short", "more", "version", "binary", "long"],
)
def test_what_is_no_key_file_is_refused_without_showing_it(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "mission.key"
    path.write_bytes(content)
    path.chmod(0o600)

    with pytest.raises(KeyFileError, match="found something else"):
        read_key(path)


@pytest.mark.parametrize(("name", "found"), [("none", "No such file"), (".", "Is a directory")])
def test_a_key_file_that_is_not_there_is_named(tmp_path: Path, name: str, found: str) -> None:
    with pytest.raises(KeyFileError, match=found):
        read_key(tmp_path / name)


# --- files of sequence numbers -----------------------------------------------------------------


def test_the_file_says_what_it_counts_and_from_where_it_is_free(path: Path) -> None:
    with SequenceFile(path, KEY, UP, Use.SENT, ahead=10) as numbers:
        assert numbers.first == 0
        assert numbers.reserve(0) == 10
        label, end = path.read_text().rsplit(" ", 1)
    assert (label[:27], end) == ("farside sequence 1 sent up ", "10\n")
    with SequenceFile(path, KEY, UP, Use.SENT) as numbers:
        assert numbers.first == 10


def test_the_file_of_a_new_key_has_to_be_created_and_only_once(tmp_path: Path, path: Path) -> None:
    with pytest.raises(KeyFileError, match="if it has, make a new key"):
        SequenceFile(tmp_path / "lost", KEY, UP, Use.SENT)
    with pytest.raises(KeyFileError, match="expected no sequence file there yet"):
        SequenceFile.create(path, KEY, UP, Use.SENT)


@pytest.mark.parametrize(
    ("key", "direction", "use"),
    [(simulated_key(8), UP, Use.SENT), (KEY, DOWN, Use.SENT), (KEY, UP, Use.HEARD)],
)
def test_the_file_of_another_key_direction_or_use_is_refused(
    path: Path, key: bytes, direction: Direction, use: Use
) -> None:
    with pytest.raises(KeyFileError, match="found 'farside sequence 1 sent up"):
        SequenceFile(path, key, direction, use)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"farside sequence 1 sent up"])
def test_a_damaged_file_is_refused_and_released(path: Path, content: bytes) -> None:
    whole = path.read_bytes()
    path.write_bytes(content)
    with pytest.raises(KeyFileError, match="expected 'farside sequence 1 sent up"):
        SequenceFile(path, KEY, UP, Use.SENT)

    path.write_bytes(whole)
    with SequenceFile(path, KEY, UP, Use.SENT) as numbers:
        assert numbers.first == 0


def test_a_file_in_use_is_refused_to_other_processes(path: Path) -> None:
    in_use = pytest.raises(KeyFileError, match="found it in use: end the other process first")
    with SequenceFile(path, KEY, UP, Use.SENT), in_use:
        SequenceFile(path, KEY, UP, Use.SENT)
    SequenceFile(path, KEY, UP, Use.SENT).close()


def test_a_closed_file_reserves_no_more_numbers(path: Path) -> None:
    numbers = SequenceFile(path, KEY, UP, Use.SENT)
    numbers.close()

    with pytest.raises(KeyFileError, match="found it closed"):
        Sealer(KEY, UP, numbers).seal(b"")


def test_numbers_end_at_the_limit_for_good(path: Path) -> None:
    with SequenceFile(path, KEY, UP, Use.SENT) as numbers:
        assert numbers.reserve(SEQUENCE_LIMIT - 3) == SEQUENCE_LIMIT
    for _ in range(2):
        exhausted = pytest.raises(SequenceExhaustedError, match="new mission key")
        with SequenceFile(path, KEY, UP, Use.SENT) as numbers, exhausted:
            Sealer(KEY, UP, numbers).seal(b"")


def test_a_receiver_that_restarts_refuses_what_it_heard(tmp_path: Path) -> None:
    path = tmp_path / "up.heard"
    SequenceFile.create(path, KEY, UP, Use.HEARD)
    ground = Sealer(KEY, UP)
    frames = [ground.seal(b"") for _ in range(200)]
    heard = []
    for part in (frames[:90], frames[50:]):
        with SequenceFile(path, KEY, UP, Use.HEARD) as numbers:
            rover = Opener(KEY, UP, numbers)
            for frame in part:
                with suppress(FrameError):
                    heard.append(rover.open(frame).sequence)

    # 64 to 127 had been reserved when it ended with 89.
    assert heard == [*range(90), *range(128, 200)]


# --- no number twice ---------------------------------------------------------------------------


class PowerCutError(Exception):
    """The process ends here."""


@contextmanager
def power_cut(step: int) -> Iterator[None]:
    """End the process at the `step`th change of the disk, before or after it is made."""
    changes = iter(range(2 * step + 2))

    def risky(change: Callable[..., object]) -> Callable[..., object]:
        def wrapped(*args: int | Path) -> object:
            if next(changes) == step:
                raise PowerCutError
            result = change(*args)
            if next(changes) == step:
                raise PowerCutError
            return result

        return wrapped

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", risky(os.fsync))
        patch.setattr(Path, "replace", risky(Path.replace))
        yield


lives = st.lists(
    st.tuples(st.integers(0, 40), st.integers(1, 12), st.none() | st.integers(0, 40)), max_size=8
)


@given(lives)
@settings(deadline=None)
def test_no_restart_or_crash_repeats_a_nonce(lives: Sequence[tuple[int | None, ...]]) -> None:
    used = []

    class Spying:
        def __init__(self, key: bytes) -> None:
            self._key, self._aead = key, AESGCM(key)

        def encrypt(self, nonce: bytes, body: bytes, header: bytes) -> bytes:
            used.append((self._key, nonce))
            return self._aead.encrypt(nonce, body, header)

    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(wire, "AESGCM", Spying)
        path = Path(folder) / "up.sent"
        SequenceFile.create(path, KEY, UP, Use.SENT)
        for frames, ahead, cut in lives:
            with suppress(PowerCutError), SequenceFile(path, KEY, UP, Use.SENT, ahead) as numbers:
                sealer = Sealer(KEY, UP, numbers)
                with power_cut(10**6 if cut is None else cut):
                    for _ in range(frames):
                        sealer.seal(b"")

    assert len(used) == len(set(used))
    assert used == sorted(used)


_LIFE = """
import sys
from pathlib import Path
from farside.link.endpoint.keys import SequenceFile, Use, simulated_key
from farside.node import Direction
from farside.link.endpoint.wire import Sealer

numbers = SequenceFile(Path(sys.argv[1]), simulated_key(7), Direction.UP, Use.SENT, ahead=3)
sealer = Sealer(simulated_key(7), Direction.UP, numbers)
while True:
    sys.stdout.buffer.write(sealer.seal(b"").hex().encode() + b"\\n")
    sys.stdout.buffer.flush()
"""


@pytest.mark.processes
def test_a_killed_process_never_repeats_a_number(path: Path) -> None:
    sent = []
    for frames in (1, 20, 7):
        with subprocess.Popen(  # noqa: S603 - ourselves
            [sys.executable, "-c", _LIFE, path], stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            sent += [process.stdout.readline() for _ in range(frames)]
            process.kill()
            sent += [line for line in process.stdout if line.endswith("\n")]

    opener = Opener(KEY, UP)
    sequences = [opener.open(bytes.fromhex(line)).sequence for line in sent]
    assert sequences == sorted(set(sequences))
