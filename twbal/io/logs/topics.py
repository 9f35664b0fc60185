"""The topics of an episode log, and the protobuf message type of each."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory

from twbal.core.channels import KINEMATIC_UNITS, MEASURED_UNITS

_FIELD = descriptor_pb2.FieldDescriptorProto


@dataclass(frozen=True)
class Topic:
    """One topic of the log and the message type on it.

    Attributes:
        id: of its channel and its schema in the file.
        name: as viewers show it.
        fields: names of the message's doubles, numbered from 1.
        units: of those fields.
        text: whether a string field `text` follows them.
    """

    id: int
    name: str
    fields: tuple[str, ...]
    units: tuple[str, ...]
    text: bool = False

    @property
    def message_name(self) -> str:
        """Full name of the message type."""
        return f"twbal.{self.name[1:].capitalize()}"

    @cached_property
    def descriptor(self) -> descriptor_pb2.FileDescriptorSet:
        """The protobuf description of the message type, as MCAP wants it."""
        file = descriptor_pb2.FileDescriptorProto(name=f"twbal{self.name}.proto", package="twbal", syntax="proto3")
        message = file.message_type.add(name=self.message_name.removeprefix("twbal."))
        kinds = [(name, _FIELD.TYPE_DOUBLE) for name in self.fields] + [("text", _FIELD.TYPE_STRING)] * self.text
        for number, (name, kind) in enumerate(kinds, start=1):
            message.field.add(name=name, number=number, type=kind, label=_FIELD.LABEL_OPTIONAL)
        return descriptor_pb2.FileDescriptorSet(file=[file])

    @cached_property
    def schema(self) -> Schema:
        """The schema record of the message type."""
        data = self.descriptor.SerializeToString(deterministic=True)
        return Schema(id=self.id, data=data, encoding="protobuf", name=self.message_name)

    @cached_property
    def decode(self) -> Callable[[bytes], Any]:
        """What reads a message."""
        decode = DecoderFactory().decoder_for("protobuf", self.schema)
        assert decode is not None
        return decode

    @cached_property
    def message_class(self) -> Any:
        """The protobuf class that writes the message.

        Its fields have presence, as in proto2: so zeros are written too, and all messages of a topic are of one length,
        which `SampleLayout.unpack` lives on. In the file the type is proto3; the bytes mean the same.
        """
        file = descriptor_pb2.FileDescriptorProto()
        file.CopyFrom(self.descriptor.file[0])
        file.ClearField("syntax")
        pool = descriptor_pool.DescriptorPool()
        pool.Add(file)
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(self.message_name))


def unit_of(channel: str) -> str:
    """Unit of a state channel; empty where twbal does not know the channel."""
    known = {**MEASURED_UNITS, **KINEMATIC_UNITS}
    return known.get(channel, "N·m" if channel.startswith("command_") else "")
