// Which message a payload holds, as far as a robot must know.
#ifndef TWBAL_INBOX_H
#define TWBAL_INBOX_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "twbal/protocol_messages.h"

namespace twbal {

enum class Heard : uint8_t { NOTHING, HELLO, STOP, ARM, COMMAND, FOLLOW, ROBOTS_OWN };

inline bool is_utf8(const uint8_t* text, size_t size)
{
    size_t k = 0;
    while (k < size) {
        const uint8_t lead = text[k++];
        if (lead < 0x80) {
            continue;
        }
        const size_t more = lead >= 0xF0 ? 3 : (lead >= 0xE0 ? 2 : 1);
        if (lead < 0xC2 || lead > 0xF4 || k + more > size) {
            return false;
        }
        const uint8_t least = lead == 0xE0 ? 0xA0 : (lead == 0xF0 ? 0x90 : 0x80);
        const uint8_t most = lead == 0xED ? 0x9F : (lead == 0xF4 ? 0x8F : 0xBF);
        if (text[k] < least || text[k] > most) { // overlong, a surrogate, or beyond U+10FFFF
            return false;
        }
        for (size_t n = 1; n < more; ++n) {
            if ((text[k + n] & 0xC0) != 0x80) {
                return false;
            }
        }
        k += more;
    }
    return true;
}

template <class Message>
inline Message message_in(const uint8_t* payload)
{
    Message message;
    memcpy(&message, payload, sizeof message);
    return message;
}

inline bool is_welcome(const uint8_t* payload, size_t size)
{
    const size_t first_layout = 14; // of version 1, up to its name
    if (size < sizeof(twbal_hello)) {
        return false;
    }
    const uint16_t version = message_in<twbal_hello>(payload).version;
    if (version != 1 && version != TWBAL_PROTOCOL_VERSION) {
        return true;
    }
    const size_t fixed = version == 1 ? first_layout : sizeof(twbal_welcome);
    return size >= fixed && payload[13] <= TWBAL_CLOCK_REAL_TIME && is_utf8(payload + fixed, size - fixed);
}

// NOTHING: an unknown type, a wrong length, a value of an enumeration that there is not, or text not in UTF-8.
inline Heard heard_in(const uint8_t* payload, size_t size)
{
    switch (payload[0]) {
    case TWBAL_TYPE_HELLO:
        return size == sizeof(twbal_hello) ? Heard::HELLO : Heard::NOTHING;
    case TWBAL_TYPE_STOP:
        return size == sizeof(twbal_stop) ? Heard::STOP : Heard::NOTHING;
    case TWBAL_TYPE_ARM:
        return size == sizeof(twbal_arm) && payload[7] <= TWBAL_DRIVE_ON_BOARD ? Heard::ARM : Heard::NOTHING;
    case TWBAL_TYPE_COMMAND:
        return size == sizeof(twbal_command) ? Heard::COMMAND : Heard::NOTHING;
    case TWBAL_TYPE_FOLLOW:
        return size == sizeof(twbal_follow) ? Heard::FOLLOW : Heard::NOTHING;
    case TWBAL_TYPE_WELCOME:
        return is_welcome(payload, size) ? Heard::ROBOTS_OWN : Heard::NOTHING;
    case TWBAL_TYPE_FAULT:
        return size >= sizeof(twbal_fault) && is_utf8(payload + sizeof(twbal_fault), size - sizeof(twbal_fault))
            ? Heard::ROBOTS_OWN
            : Heard::NOTHING;
    case TWBAL_TYPE_POSE_REPORT:
        return size == sizeof(twbal_pose_report) ? Heard::ROBOTS_OWN : Heard::NOTHING;
    case TWBAL_TYPE_TELEMETRY:
        return size == sizeof(twbal_telemetry) ? Heard::ROBOTS_OWN : Heard::NOTHING;
    default:
        return Heard::NOTHING;
    }
}

} // namespace twbal

#endif
