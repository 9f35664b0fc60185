import numpy as np

from twbal.core.gaussian import Array
from twbal.io.logs.layout import Layout


def packed(layout: Layout, count: int) -> tuple[bytes, Array]:
    values = np.random.default_rng(1).standard_normal((count, len(layout.fields)))
    return layout.pack(5, np.arange(count, dtype=np.uint64), values), values


def test_samples_are_unpacked_as_they_were_packed() -> None:
    layout = Layout(("tilt", "tilt_rate"))
    data, values = packed(layout, 9)
    numbers, found = layout.unpack(b"before" + data + b"after", 6)
    assert numbers.tolist() == list(range(5, 14))
    assert found.tobytes() == values.tobytes()


def test_unpacking_stops_at_the_first_sample_that_differs_in_form() -> None:
    layout = Layout(("tilt", "tilt_rate"))
    data, values = packed(layout, 9)
    size = len(layout.template)
    for place in layout.fixed:
        changed = bytearray(data)
        changed[4 * size + place] ^= 1
        numbers, found = layout.unpack(bytes(changed), 0)
        assert numbers.tolist() == [5, 6, 7, 8]
        assert found.tobytes() == values[:4].tobytes()


def test_payloads_are_what_protobuf_itself_writes() -> None:
    layout = Layout(tuple(f"channel_{i}" for i in range(20)))  # field numbers of one and of two bytes
    data, values = packed(layout, 1)
    ends = [*layout.offsets[1:], len(layout.template)]
    column = 0
    for topic, start, end in zip(layout.samples, layout.offsets, ends, strict=True):
        fields = dict(zip(topic.fields, values[0, column:], strict=False))
        assert data[start + 31 : end] == topic.message_class(**fields).SerializeToString(deterministic=True)
        column += len(topic.fields)
