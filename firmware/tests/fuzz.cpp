// Random and mutated bytes into the decoder and the whole robot: fuzz <bytes> <seed>. Built with sanitizers.
//
// After each piece of noise one good frame is sent, which must be taken: the decoder is in step again within one frame.
// Frames that were made of noise and accepted all the same are CRC collisions; they are counted, and must stay as rare
// as a CRC of 16 bits promises.
#include <stdio.h>
#include <stdlib.h>

#include "fake_board.h"

namespace {

uint64_t state = 1;

uint32_t drawn(uint32_t below)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<uint32_t>((state >> 11) % below);
}

struct Noise {
    uint8_t bytes[700];
    size_t size = 0;
    uint8_t payload[80]; // of the frame that was changed
    size_t payload_size = 0;
    void write(const uint8_t* from, size_t count)
    {
        memcpy(bytes + size, from, count);
        size += count;
    }
};

// Bytes at random, few of them zero; or a frame of a message with some of its bytes changed, lost or doubled.
Noise noise()
{
    Noise made;
    if (drawn(2)) {
        made.size = drawn(400);
        for (size_t k = 0; k < made.size; ++k) {
            made.bytes[k] = static_cast<uint8_t>(drawn(8) ? drawn(256) : 0);
        }
        return made;
    }
    made.payload_size = 3 + drawn(70);
    for (size_t k = 0; k < made.payload_size; ++k) {
        made.payload[k] = static_cast<uint8_t>(drawn(3) ? drawn(256) : 0);
    }
    made.payload[0] = static_cast<uint8_t>(drawn(8) + (drawn(4) ? 0 : 0x80));
    twbal::write_frame(made, made.payload, made.payload_size);
    for (uint32_t changes = 1 + drawn(4); changes > 0; --changes) {
        const size_t at = drawn(static_cast<uint32_t>(made.size));
        switch (drawn(3)) {
        case 0:
            made.bytes[at] = static_cast<uint8_t>(made.bytes[at] ^ (1u << drawn(8)));
            break;
        case 1:
            memmove(made.bytes + at, made.bytes + at + 1, made.size - at - 1);
            --made.size;
            break;
        default:
            memmove(made.bytes + at + 1, made.bytes + at, made.size - at);
            ++made.size;
        }
    }
    return made;
}

// A frame that is whole after all, as only its borders were changed, or changes took each other back.
bool is_whole(const twbal::FrameReader& reader, const Noise& sent)
{
    return reader.size() == sent.payload_size && memcmp(reader.payload(), sent.payload, sent.payload_size) == 0;
}

} // namespace

int main(int count, char** words)
{
    const unsigned long most = count > 1 ? strtoul(words[1], nullptr, 10) : 100000;
    state = count > 2 ? strtoul(words[2], nullptr, 10) * 2654435761u + 1 : 1;
    static FakeBoard board;
    FakePolicy policy;
    const twbal::Identity me = fake_identity(TWBAL_CLOCK_REAL_TIME);
    FakeRobot robot(me, board, policy);
    twbal::FrameReader reader;
    unsigned long bytes = 0, pieces = 0, corrupt = 0, lost = 0, runs = 0;
    uint32_t now = 0;
    while (bytes < most) {
        const Noise bad = noise();
        for (size_t k = 0; k < bad.size; ++k) {
            runs += bad.bytes[k] == 0;
            corrupt += reader.feed(bad.bytes[k]) && !is_whole(reader, bad);
        }
        Noise good;
        const twbal_stop stop = {TWBAL_TYPE_STOP, static_cast<uint16_t>(drawn(65536))};
        twbal::write_frame(good, reinterpret_cast<const uint8_t*>(&stop), sizeof stop);
        bool is_taken = false;
        for (size_t k = 0; k < good.size; ++k) {
            const bool is_frame = reader.feed(good.bytes[k]);
            is_taken = is_frame && reader.size() == sizeof stop && memcmp(reader.payload(), &stop, sizeof stop) == 0;
            corrupt += is_frame && !is_taken && !is_whole(reader, bad); // noise that the first zero ended
        }
        lost += !is_taken;
        now += drawn(30000);
        robot.receive(bad.bytes, bad.size, now);
        robot.run(now);
        bytes += bad.size + good.size;
        ++pieces;
    }
    const unsigned long collisions = 10 + runs / 8192; // eight times what one in 65536 comes to
    printf("fuzz: %lu bytes, %lu good frames after noise, %lu lost; %lu of %lu corrupt runs accepted\n", bytes, pieces, lost,
        corrupt, runs);
    return lost != 0 || corrupt > collisions;
}
