"""Packing a log: its messages in compressed chunks of a megabyte, with an index at the end."""

import os
from pathlib import Path

from mcap.writer import Writer

from farside.logs.index import LogError
from farside.logs.reading import LogFile

_CHUNK_BYTE = 1 << 20


def pack(log: LogFile, target: Path) -> None:
    """Write a packed copy of `log` in place of `target`, which is there whole or not at all.

    Raises:
        LogError: if `log` is damaged, or there is no room; `target` is then as before.
    """
    scratch = target.with_name(f".{target.name}.{os.getpid()}.packing")
    try:
        with scratch.open("xb") as file:
            _write(log, Writer(file, chunk_size=_CHUNK_BYTE))
        scratch.replace(target)
    except OSError as error:
        raise LogError(f"{target} cannot be packed: {error.strerror}") from error
    finally:
        scratch.unlink(missing_ok=True)


def _write(log: LogFile, writer: Writer) -> None:
    writer.start(library=log.library)
    schemas = {
        number: writer.register_schema(schema.name, schema.encoding, schema.data)
        for number, schema in log.index.schemas.items()
    }
    channels = {
        channel.topic: writer.register_channel(
            channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
        )
        for channel in log.index.channels.values()
    }
    for name, attachment in log.attachments.items():
        writer.add_attachment(0, 0, name, attachment.media_type, attachment.data)
    for record in log.records():
        writer.add_message(
            channels[record.topic], record.log_time_ns, record.payload, record.publish_time_ns
        )
    for name, metadata in log.metadata.items():
        writer.add_metadata(name, dict(metadata))
    writer.finish()
