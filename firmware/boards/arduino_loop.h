// The loop that all boards of Arduino share: bytes, samples, control periods, motors.
#ifndef TWBAL_ARDUINO_LOOP_H
#define TWBAL_ARDUINO_LOOP_H

#include <Arduino.h>

#include "twbal/robot.h"
#include "twbal/two_wheels.h"

namespace twbal {

// FNV-1a of a text: of the time of compilation, a number that each build has for itself.
constexpr uint32_t build_number(const char* text, uint32_t hash = 2166136261u)
{
    return *text == 0 ? hash : build_number(text + 1, (hash ^ static_cast<uint8_t>(*text)) * 16777619u);
}
static_assert(build_number("foobar") == 0xbf9cf968u, "a test vector of FNV-1a");

#ifdef __AVR__
const uint32_t SAMPLE_US = 5000; // reading the IMU takes a millisecond, and single precision is software
#else
const uint32_t SAMPLE_US = 2000;
#endif

template <class Body, class Robot, class Line>
class ArduinoLoop {
public:
    ArduinoLoop(Body& body, Robot& robot, Line& line) : body_(body), robot_(robot), line_(line) {}

    void turn()
    {
        const uint32_t now = static_cast<uint32_t>(micros());
        const uint32_t since = now - sampled_us_;
        if (since >= SAMPLE_US) {
            sampled_us_ = now;
            body_.sample(1e-6f * static_cast<float>(since), robot_.motors_may_be_on());
            body_.drive(robot_.output(), robot_.drive(), robot_.motors_may_be_on());
        }
        for (int left = MOST_BYTES; left > 0 && line_.available() > 0; --left) { // a line that is flooded waits
            const uint8_t byte = static_cast<uint8_t>(line_.read());
            robot_.receive(&byte, 1, now);
        }
        robot_.skip_missed(now);
        robot_.run(now);
        if (!robot_.motors_may_be_on()) {
            body_.drive(WheelCommands{0.0f, 0.0f}, TWBAL_DRIVE_TORQUE, false); // at once, not at the next sample
        }
    }

private:
    static constexpr int MOST_BYTES = 256; // of a turn: more than come in a millisecond at 921600 baud

    Body& body_;
    Robot& robot_;
    Line& line_;
    uint32_t sampled_us_ = 0;
};

} // namespace twbal

#endif
