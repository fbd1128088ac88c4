"""Pictures decoded by protobuf's own library, with the schemas that a log has of them."""

from collections.abc import Iterable
from functools import cache
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from farside.logs.foxglove.names import PICTURES, PictureTopic
from farside.logs.foxglove.pictures import Pictures
from farside.node import Record


@cache
def message_class(schema: bytes, name: str) -> Any:
    """The class of the messages of a schema, which is a `FileDescriptorSet`."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


def decoded(record: Record) -> Any:
    """The message of a picture."""
    topic = PICTURES[record.topic]
    return message_class(topic.schema(), topic.schema_name).FromString(record.payload)


def drawn(records: Iterable[Record], topic: PictureTopic) -> list[tuple[float, Any]]:
    """The pictures of a topic that belong to these records, each with its log time in seconds."""
    pictures = Pictures().beside(records)
    return [
        (record.log_time_ns / 1e9, decoded(record))
        for record in pictures
        if record.topic == topic.name
    ]
