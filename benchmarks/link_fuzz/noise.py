"""Random and mutated bytes into the decoder in Python, as `firmware/tests/fuzz.cpp` gives them to the one in C++."""

from typing import Any, NamedTuple

import numpy as np

from twbal.link.decoder import Decoder, to_wire
from twbal.link.frame import Splitter, unwrap, wrap
from twbal.link.protocol import Stop


class Noise(NamedTuple):
    """Bytes that no host sent.

    Attributes:
        data: the bytes.
        payload: of the frame that was changed; empty: they are random.
    """

    data: bytes
    payload: bytes


def noise(rng: np.random.Generator) -> Noise:
    """Bytes at random, few of them zero; or a frame with some of its bytes changed, lost or doubled."""
    if rng.random() < 0.5:
        data = rng.integers(0, 256, rng.integers(400))
        return Noise(np.where(rng.random(data.size) < 0.125, 0, data).astype(np.uint8).tobytes(), b"")
    plain = rng.integers(0, 256, 3 + rng.integers(70))
    plain = np.where(rng.random(plain.size) < 1 / 3, 0, plain)
    plain[0] = rng.integers(8) + (0x80 if rng.random() < 0.25 else 0)
    payload = plain.astype(np.uint8).tobytes()
    data = bytearray(wrap(payload))
    for _ in range(1 + rng.integers(4)):
        at = int(rng.integers(len(data)))
        match int(rng.integers(3)):
            case 0:
                data[at] ^= 1 << int(rng.integers(8))
            case 1:
                del data[at]
            case _:
                data.insert(at, data[at])
    return Noise(bytes(data), payload)


def decoded(size: int, seed: int) -> dict[str, Any]:
    """What the decoder makes of `size` bytes; after each piece of noise a frame is sent, which must be heard.

    Returns:
        bytes; frames: after noise; lost: of these; runs: of noise between zeros; accepted: of these, by the CRC.
    """
    rng = np.random.default_rng(seed)
    decoder, splitter = Decoder(), Splitter()
    found = dict.fromkeys(("bytes", "frames", "lost", "runs", "accepted"), 0)
    while found["bytes"] < size:
        bad = noise(rng)
        good = Stop(int(rng.integers(65536)))
        wire = to_wire(good)
        heard = decoder.feed(bad.data) + decoder.feed(wire)
        payloads = [unwrap(run) for run in splitter.feed(bad.data + wire)]
        found["bytes"] += len(bad.data) + len(wire)
        found["frames"] += 1
        found["lost"] += not heard or heard[-1] != good
        found["runs"] += bad.data.count(0)
        found["accepted"] += sum(payload is not None and payload != bad.payload for payload in payloads[:-1])
    return found
