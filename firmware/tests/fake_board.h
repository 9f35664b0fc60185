// A board without a world: sensors are what the test sets, and what is written is kept.
#ifndef TWBAL_FAKE_BOARD_H
#define TWBAL_FAKE_BOARD_H

#include <string.h>

#include "twbal/robot.h"

struct FakeBoard {
    twbal::Sensed seen;
    twbal::WheelCommands applied = {0.0f, 0.0f}; // in the last period
    bool arms = true;
    float elapsed = 0.0f; // [s] before the last look
    int looks = 0;
    uint8_t sent[65536];
    size_t size = 0;

    FakeBoard() { seen.tilt = seen.tilt_rate = seen.wheel_angle = seen.wheel_rate = 0.0f; }
    bool arm(uint32_t) { return arms; }
    twbal::Sensed sense(twbal::WheelCommands given, uint8_t, float since)
    {
        applied = given;
        elapsed = since;
        ++looks;
        return seen;
    }
    bool pose(twbal_pose_report&) const { return false; }
    void write(const uint8_t* bytes, size_t count)
    {
        if (size + count > sizeof sent) {
            size = 0; // nobody has read it
        }
        memcpy(sent + size, bytes, count);
        size += count;
    }
};

// Commands twice the tilt, the reference's place and 0.5 where that gives way; and the reference's speed as difference.
struct FakePolicy {
    int calls = 0;
    void reset() { calls = 0; }
    twbal::WheelCommands step(const twbal::Sensed& seen, float, const twbal_follow& order)
    {
        ++calls;
        return twbal::WheelCommands{2.0f * seen.tilt + order.position + (order.gives_way ? 0.5f : 0.0f), order.speed};
    }
};

using FakeRobot = twbal::Robot<FakeBoard, FakePolicy>;

inline twbal::Identity fake_identity(uint8_t clock)
{
    return twbal::Identity{"fake", 20000, 20.0f, 10.0f, NAN, 1.0f, clock, 0x00FF, 7, 0,
        {TWBAL_WATCHDOG_US, TWBAL_ON_BOARD_WATCHDOG_US}};
}

#endif
