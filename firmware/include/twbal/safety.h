// When the motors may be on. All of it is in one table and three checks; nothing else switches them on.
#ifndef TWBAL_SAFETY_H
#define TWBAL_SAFETY_H

#include <math.h>
#include <stdint.h>

#include "twbal/protocol_messages.h"
#include "twbal/quantities.h"

namespace twbal {

enum class State : uint8_t { STRANGE, OFF, ARMED, TRIPPED };
const int STATES = 4;

enum class Event : uint8_t {
    HELLO,       // of this version
    HELLO_OTHER, // of another one
    ARM,
    ARM_REFUSED, // one that cannot be followed
    DRIVE,       // a command or a reference, of this drive and finite
    DRIVE_REFUSED,
    STOP,
    NOT_A_HOSTS, // a robot's message
    PORT_CLOSED,
    TRIP
};
const int EVENTS = 10;

enum class Reply : uint8_t { NONE, WELCOME, FAULT, TELEMETRY, STREAM }; // STREAM: as the clock says

struct Transition {
    State next;
    Reply reply;
};

// docs/protocol.md, "The robot's states".
inline Transition transition(State state, Event event)
{
    static const Transition TABLE[STATES][EVENTS] = {
#define TWBAL_HELLOS {State::OFF, Reply::WELCOME}, {State::STRANGE, Reply::WELCOME}
        {TWBAL_HELLOS,
            {State::STRANGE, Reply::FAULT}, {State::STRANGE, Reply::FAULT}, {State::STRANGE, Reply::FAULT},
            {State::STRANGE, Reply::FAULT}, {State::STRANGE, Reply::FAULT}, {State::STRANGE, Reply::FAULT},
            {State::STRANGE, Reply::NONE}, {State::STRANGE, Reply::NONE}},
        {TWBAL_HELLOS,
            {State::ARMED, Reply::TELEMETRY}, {State::OFF, Reply::FAULT}, {State::OFF, Reply::FAULT},
            {State::OFF, Reply::FAULT}, {State::OFF, Reply::TELEMETRY}, {State::OFF, Reply::FAULT},
            {State::STRANGE, Reply::NONE}, {State::OFF, Reply::NONE}},
        {TWBAL_HELLOS,
            {State::ARMED, Reply::TELEMETRY}, {State::ARMED, Reply::FAULT}, {State::ARMED, Reply::STREAM},
            {State::ARMED, Reply::FAULT}, {State::OFF, Reply::TELEMETRY}, {State::ARMED, Reply::FAULT},
            {State::STRANGE, Reply::NONE}, {State::TRIPPED, Reply::NONE}},
        {TWBAL_HELLOS,
            {State::ARMED, Reply::TELEMETRY}, {State::TRIPPED, Reply::FAULT}, {State::TRIPPED, Reply::STREAM},
            {State::TRIPPED, Reply::FAULT}, {State::OFF, Reply::TELEMETRY}, {State::TRIPPED, Reply::FAULT},
            {State::STRANGE, Reply::NONE}, {State::TRIPPED, Reply::NONE}},
#undef TWBAL_HELLOS
    };
    return TABLE[static_cast<int>(state)][static_cast<int>(event)];
}

struct Watchdogs {
    uint32_t host_us;     // silence at which a robot that the host drives stops
    uint32_t on_board_us; // the same with the policy on board
};

class Safety {
public:
    Safety(float tilt_limit, Watchdogs watchdogs) : tilt_limit_(tilt_limit), watchdogs_(watchdogs) {}

    State state() const { return state_; }
    bool motors_may_be_on() const { return state_ == State::ARMED; }

    // Bits of the telemetry's status that say why the motors are off, or that they are on.
    uint8_t status() const
    {
        return state_ == State::ARMED ? TWBAL_STATUS_ARMED : (state_ == State::TRIPPED ? reason_ : uint8_t{0});
    }

    Reply on(Event event)
    {
        const Transition made = transition(state_, event);
        state_ = made.next;
        return made.reply;
    }

    // A new and valid message of the host came.
    void heard(uint32_t now_us) { heard_us_ = now_us; }
    uint32_t heard_us() const { return heard_us_; }
    uint32_t silence_us(uint32_t now_us) const
    {
        const uint32_t since = now_us - heard_us_;
        return since < 0x80000000u ? since : 0; // it came after the moment that is looked at
    }

    void check_watchdog(uint32_t now_us, bool on_board)
    {
        if (silence_us(now_us) > (on_board ? watchdogs_.on_board_us : watchdogs_.host_us)) {
            trip(TWBAL_STATUS_WATCHDOG_STOPPED);
        }
    }

    void check_sensors(const Sensed& seen)
    {
        if (!isfinite(seen.tilt) || !isfinite(seen.tilt_rate) || !isfinite(seen.wheel_angle)
            || !isfinite(seen.wheel_rate)) {
            trip(TWBAL_STATUS_SENSOR_STOPPED);
        } else if (fabsf(seen.tilt) > tilt_limit_) {
            trip(TWBAL_STATUS_TILT_STOPPED);
        }
    }

    void trip(uint8_t reason)
    {
        if (state_ == State::ARMED) {
            reason_ = reason;
        }
        on(Event::TRIP);
    }

private:
    float tilt_limit_;
    Watchdogs watchdogs_;
    State state_ = State::STRANGE;
    uint8_t reason_ = 0;
    uint32_t heard_us_ = 0;
};

} // namespace twbal

#endif
