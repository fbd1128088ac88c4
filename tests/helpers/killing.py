"""Runs of real processes, one of which is killed at a random moment; and what their logs hold."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from mcap.reader import make_reader
from npm import run_script

from farside.logs import LogFile, RunView
from farside.node import NEVER_NS, Record, to_ns

WHOLE_BYTE = 4_500_000  # what the mission writes before its log is packed, and a little more
_PATIENCE_S = 120

_STREAM_READER = """
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";
for (const path of process.argv.slice(2)) {
  const reader = new McapStreamReader({
    decompressHandlers: { zstd: (data) => decompress(data) },
    validateCrcs: true,
  });
  reader.append(readFileSync(path));
  const topics = new Map(), hash = createHash("sha256");
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type !== "Message") continue;
    hash.update(`${topics.get(record.channelId)} ${record.logTime} ${record.data.length} `);
    hash.update(record.data);
  }
  if (!reader.done()) throw new Error(`${path} does not end as an MCAP file does`);
  console.log(hash.digest("hex"));
}
"""


def killed_log(out: Path, chance: random.Random, *, in_process: bool) -> tuple[Path, str]:
    """Run a mission and kill one of its processes at a random moment.

    Args:
        out: folder for the log.
        chance: decides which one, and when: once the log has a certain length.
        in_process: whether the run is one process.

    Returns:
        The log, and which process was killed.
    """
    at_byte = chance.randrange(30_000, WHOLE_BYTE)
    command = [sys.executable, "-m", "farside", "run", "blackout", "--out", str(out)]
    with subprocess.Popen(  # noqa: S603
        [*command, "--in-process"] if in_process else command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as run:
        until_s = time.monotonic() + _PATIENCE_S
        logs: list[Path] = []
        while run.poll() is None and time.monotonic() < until_s:
            logs = [*out.glob("[!.]*.mcap")]
            if logs and logs[0].stat().st_size >= at_byte:
                break
            # Nothing tells of the length of another process's file. Whenever this looks, and
            # however late it strikes, what the tests demand of the log is the same.
            time.sleep(0.002)
        victim = chance.choice([run.pid, *_children(run.pid)])
        what = "launcher" if victim == run.pid else "node"
        try:
            os.kill(victim, signal.SIGKILL)
        except ProcessLookupError:
            what = "nobody: the run was over"
        run.wait(timeout=_PATIENCE_S)
        _end(run.pid)
    return logs[0], what


def _children(parent: int) -> list[int]:
    listed = Path(f"/proc/{parent}/task/{parent}/children")
    return [int(number) for number in listed.read_text().split()] if listed.exists() else []


def _end(session: int) -> None:
    """End what is left of a session whose leader was killed."""
    try:
        os.killpg(session, signal.SIGKILL)
    except ProcessLookupError:
        return


def read_by_mcap(path: Path) -> list[Record]:
    """The records of a log as the `mcap` library reads them."""
    with path.open("rb") as file:
        return [
            Record(channel.topic, message.log_time, message.publish_time, message.data)
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(
                log_time_order=False
            )
        ]


def hashes_by_npm(*paths: Path) -> list[str]:
    """A hash over all messages of each log, as `@mcap/core` reads them."""
    return run_script(_STREAM_READER, *paths).split()


def records_of(path: Path) -> list[Record]:
    """All records of a log, pictures included, as our reader reads them."""
    return list(LogFile(path).records(pictures=True))


def common_end_ns(log: LogFile) -> int:
    """Up to when a log must hold what that of the whole run holds.

    That is to its end if the recorder was killed, and to the loss of a node if it was that.
    """
    view = RunView(log)
    if view.result is None or not view.result.lost_processes:
        return NEVER_NS
    return to_ns(view.result.lost_processes[0].since_s)
