// Frames on the line: 00, COBS(payload, CRC), 00. The reader is in step again at the next zero, whatever came before.
#ifndef TWBAL_FRAME_H
#define TWBAL_FRAME_H

#include <stddef.h>
#include <stdint.h>

#include "twbal/protocol_messages.h"

namespace twbal {

// CRC-16/IBM-3740, bit by bit: a table would take 512 bytes of flash, and telemetry has 66 bytes.
inline uint16_t crc16(const uint8_t* data, size_t size)
{
    uint16_t crc = 0xFFFF;
    for (size_t k = 0; k < size; ++k) {
        crc = static_cast<uint16_t>(crc ^ static_cast<uint16_t>(data[k] << 8));
        for (int bit = 0; bit < 8; ++bit) {
            const bool carries = (crc & 0x8000u) != 0;
            crc = static_cast<uint16_t>(crc << 1);
            if (carries) {
                crc = static_cast<uint16_t>(crc ^ 0x1021u);
            }
        }
    }
    return crc;
}

// Undo COBS in place; the size of the result, or -1 where the bytes are no COBS.
inline int cobs_decode(uint8_t* bytes, size_t size)
{
    size_t from = 0, to = 0;
    while (from < size) {
        const size_t code = bytes[from++];
        if (code == 0 || from + code - 1 > size) {
            return -1;
        }
        for (size_t k = 1; k < code; ++k) {
            if (bytes[from] == 0) {
                return -1;
            }
            bytes[to++] = bytes[from++];
        }
        if (code < 0xFF && from < size) {
            bytes[to++] = 0;
        }
    }
    return static_cast<int>(to);
}

// Turns bytes into payloads. What is no frame is counted and dropped.
class FrameReader {
public:
    // Take a byte; true where it completes a frame whose CRC is right.
    bool feed(uint8_t byte)
    {
        if (byte != 0) {
            take(byte);
            return false;
        }
        const size_t run = overlong_ ? 0 : size_;
        size_ = 0;
        overlong_ = false;
        return run > 0 && decode(run);
    }

    const uint8_t* payload() const { return bytes_; }
    size_t size() const { return payload_size_; }
    uint16_t dropped() const { return dropped_; }
    void drop() { ++dropped_; } // a frame that is no message

private:
    void take(uint8_t byte)
    {
        if (size_ == TWBAL_MAX_FRAME && !overlong_) {
            overlong_ = true;
            ++dropped_;
        }
        if (!overlong_) {
            bytes_[size_++] = byte;
        }
    }

    bool decode(size_t run)
    {
        const int plain = cobs_decode(bytes_, run);
        if (plain < 3) { // a type at least, and the CRC
            ++dropped_;
            return false;
        }
        payload_size_ = static_cast<size_t>(plain) - 2;
        const uint8_t* crc = bytes_ + payload_size_;
        const uint16_t sent = static_cast<uint16_t>(crc[0] | static_cast<uint16_t>(crc[1] << 8));
        if (crc16(bytes_, payload_size_) != sent) {
            ++dropped_;
            return false;
        }
        return true;
    }

    uint8_t bytes_[TWBAL_MAX_FRAME] = {};
    size_t size_ = 0, payload_size_ = 0;
    bool overlong_ = false;
    uint16_t dropped_ = 0;
};

// Writes a payload as a frame; `Sink` has write(const uint8_t*, size_t).
template <class Sink>
inline void write_frame(Sink& sink, const uint8_t* payload, size_t size)
{
    uint8_t frame[TWBAL_MAX_FRAME + 2];
    const uint16_t crc = crc16(payload, size);
    const uint8_t tail[2] = {static_cast<uint8_t>(crc & 0xFF), static_cast<uint8_t>(crc >> 8)};
    size_t to = 0, code_at = 1;
    frame[to++] = 0;
    frame[to++] = 1;
    for (size_t k = 0; k < size + 2; ++k) {
        const uint8_t byte = k < size ? payload[k] : tail[k - size];
        if (byte != 0) {
            frame[to++] = byte;
            ++frame[code_at];
        }
        if ((byte == 0 || frame[code_at] == 0xFF) && (byte == 0 || k + 1 < size + 2)) {
            code_at = to;
            frame[to++] = 1;
        }
    }
    frame[to++] = 0;
    sink.write(frame, to);
}

} // namespace twbal

#endif
