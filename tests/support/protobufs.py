"""Messages of the leagues as protobuf's own library has them, from descriptors that are built here."""

from collections.abc import Mapping, Sequence
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

#: Fields of each message: name, number, and type. A type is protobuf's, or a message by its name. One that
#: begins with ``*`` is repeated, with ``!`` required.
Wire = Mapping[str, Sequence[tuple[str, int, str]]]


def message_class(wire: Wire, name: str) -> Any:
    """Protobuf's class of a message."""
    kinds = descriptor_pb2.FieldDescriptorProto
    labels = {"*": kinds.LABEL_REPEATED, "!": kinds.LABEL_REQUIRED}
    file = descriptor_pb2.FileDescriptorProto(name="test.proto", package="test", syntax="proto2")
    for message_name, fields in wire.items():
        message = file.message_type.add(name=message_name)
        for field, number, kind in fields:
            bare = kind.lstrip("*!")
            message.field.add(
                name=field, number=number, label=labels.get(kind[0], kinds.LABEL_OPTIONAL),
                type=kinds.TYPE_MESSAGE if bare in wire else getattr(kinds, f"TYPE_{bare.upper()}"),
                type_name=f".test.{bare}" if bare in wire else None,
            )
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"test.{name}"))
