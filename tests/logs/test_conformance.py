"""Every message of a log is what its schema says, to Python, to JavaScript and to Rerun."""

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import jsonschema
import pyarrow as pa
import pytest
from drawn import message_class
from google.protobuf import unknown_fields
from mcap.reader import make_reader
from npm import run_script

from farside.logs import LogFile, Recorder, decode
from farside.logs.foxglove.names import PICTURES, TRUTH_FRAMES, TRUTH_NUMBERS
from farside.topics import TOPICS, TRUTH_POSE, Pose

_FIRST, _OF = 40, 40  # of each topic the first messages, and one in so many of the others


@pytest.fixture(scope="session")
def small(flown: LogFile, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with some of the messages of each topic of a run."""
    path, count = tmp_path_factory.mktemp("small") / "small.mcap", Counter[str]()
    with Recorder(path) as recorder:
        for record in flown.records():
            count[record.topic] += 1
            number = count[record.topic]
            if number <= _FIRST or number % _OF == 0:
                recorder.write([record])
    return path


def counts(log: Path) -> Counter[str]:
    return Counter(record.topic for record in LogFile(log).records(pictures=True))


def test_the_log_has_messages_of_nearly_all_topics(small: Path) -> None:
    silent = {*TOPICS, *PICTURES} - counts(small).keys()

    assert silent <= {"/truth/bump", "/ground/held", "/link/hop"}, (
        "what does not happen in this mission"
    )


def test_python_takes_every_message_by_its_schema(small: Path) -> None:
    validators: dict[int, Any] = {}
    found = Counter[str]()
    with small.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if schema.encoding == "protobuf":
                kind = message_class(schema.data, schema.name)
                decoded = kind.FromString(message.data)
                assert decoded.ByteSize() > 0
                assert not _unknown(decoded), f"{channel.topic} has what its schema lacks"
            else:
                if schema.id not in validators:
                    whole = json.loads(schema.data)
                    jsonschema.Draft202012Validator.check_schema(whole)
                    validators[schema.id] = jsonschema.Draft202012Validator(whole)
                validators[schema.id].validate(json.loads(message.data))
            found[channel.topic] += 1

    assert found == counts(small)


def _unknown(message: Any) -> bool:
    """Whether anything was left over when a message was decoded."""
    return len(unknown_fields.UnknownFieldSet(message)) > 0


_JAVASCRIPT = """
import { readFileSync } from "node:fs";
import { McapIndexedReader } from "@mcap/core";
import Ajv2020 from "ajv/dist/2020.js";
import { decompress } from "fzstd";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

const bytes = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) },
});
const ajv = new Ajv2020.default({ strict: false });
const decoders = new Map();
for (const schema of reader.schemasById.values()) {
  if (schema.encoding === "protobuf") {
    const set = descriptor.FileDescriptorSet.decode(schema.data);
    const type = protobuf.Root.fromDescriptor(set).lookupType(schema.name);
    decoders.set(schema.id, (data) => {
      const message = type.decode(data);
      const complaint = type.verify(message);
      if (complaint) throw new Error(`${schema.name}: ${complaint}`);
      return message;
    });
  } else {
    const validate = ajv.compile(JSON.parse(new TextDecoder().decode(schema.data)));
    decoders.set(schema.id, (data) => {
      const message = JSON.parse(new TextDecoder().decode(data));
      if (!validate(message)) throw new Error(`${schema.name}: ${ajv.errorsText(validate.errors)}`);
      return message;
    });
  }
}
const counts = {};
let numbers = null;
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const decoded = decoders.get(channel.schemaId)(message.data);
  counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
  if (channel.topic === "/truth/numbers") numbers = decoded;
}
console.log(JSON.stringify({ counts, battery: numbers.battery }));
"""


def test_javascript_takes_every_message_by_its_schema(small: Path) -> None:
    """As Foxglove and Lichtblick read it: `@mcap/core`, a JSON Schema validator, protobufjs."""
    found = json.loads(run_script(_JAVASCRIPT, small))

    last = LogFile(small).latest(TRUTH_NUMBERS, LogFile(small).end_ns)
    assert last is not None
    kind = message_class(TRUTH_NUMBERS.schema(), TRUTH_NUMBERS.schema_name)
    assert found["counts"] == counts(small)
    assert found["battery"] == kind.FromString(last.payload).battery


# --- Rerun -------------------------------------------------------------------------------------


def entities(log: Path) -> dict[str, list[dict[str, Any]]]:
    """The rows of every entity that Rerun makes of a log, without what says where they are from."""
    from rerun.chunk import McapReader  # noqa: PLC0415

    found: dict[str, list[dict[str, Any]]] = {}
    for chunk in McapReader(log).stream():
        rows = found.setdefault(chunk.entity_path, [])
        batch = chunk.to_record_batch()
        names = batch.schema.names
        columns = [
            column.cast("int64") if pa.types.is_timestamp(column.type) else column
            for column in batch.columns
        ]
        for row in zip(*(column.to_pylist() for column in columns), strict=True):
            told = zip(names, row, strict=True)
            rows.append({name: value for name, value in told if value is not None})
    return found


@pytest.fixture(scope="session")
def seen(small: Path) -> dict[str, list[dict[str, Any]]]:
    return entities(small)


def values(rows: list[dict[str, Any]], component: str) -> Iterator[Any]:
    return (row[component][0] for row in rows if component in row)


def test_rerun_has_the_rover_where_it_was(
    small: Path, seen: dict[str, list[dict[str, Any]]]
) -> None:
    rows = [row for row in seen[TRUTH_FRAMES.name] if "Transform3D:translation" in row]
    found = {
        row["timestamp"]: row["Transform3D:translation"][0][:2]
        for row in rows
        if row["Transform3D:child_frame"] == ["rover_truth"]
    }
    poses = [
        (record.log_time_ns, cast("Pose", decode(record)))
        for record in LogFile(small).records([TRUTH_POSE])
    ]

    true = {time_ns: [pose.x_m, pose.y_m] for time_ns, pose in poses}
    assert len(found) > 20
    assert all(at == pytest.approx(true[time_ns], abs=1e-5) for time_ns, at in found.items())


def test_rerun_has_values_of_every_picture(seen: dict[str, list[dict[str, Any]]]) -> None:
    """No picture is a row of bytes to it."""
    for topic in PICTURES:
        components = {name for row in seen[topic] for name in row}
        assert not any("Message:data" in name for name in components), topic
        assert any(
            name.startswith(("Transform3D:", "InstancePoses3D:", "TextLog:", "VoxelGridMap:"))
            or name.endswith(":message")
            for name in components
        ), topic
    modes = [state["mode"] for state in values(seen["/rover/state"], "farside.RoverState:message")]
    assert {"guided", "shared", "autonomous"} <= set(modes)
    (texts,) = [list(values(seen["/rover/events"], "TextLog:text"))]
    assert "mode autonomous: link lost" in texts


def test_rerun_finds_nothing_wrong_with_the_log(small: Path) -> None:
    checked = subprocess.run(  # noqa: S603
        [Path(sys.executable).parent / "rerun", "mcap", "check", "--full", small],
        env={**os.environ, "CI": "true"},  # so that it does not report its use
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    rows = [line for line in checked.stdout.splitlines() if line.split()[1:2] and "/" in line]

    assert checked.returncode == 0, checked.stderr
    topics = {line.split()[3]: (line.split()[0], line.split()[4]) for line in rows}
    assert topics == dict.fromkeys(counts(small), ("ok", "—"))
