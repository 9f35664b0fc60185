// The robot's body as another process: what the motors get goes to it over a pipe, what the sensors say comes back.
// twbal/virtual_robot/posix_firmware.py is the other end.
#ifndef TWBAL_POSIX_PHYSICS_H
#define TWBAL_POSIX_PHYSICS_H

#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include "twbal/protocol_messages.h"
#include "twbal/quantities.h"

namespace twbal {

#pragma pack(push, 1)
struct PhysicsOrder {
    char kind; // 'R': put the robot at its start for `trial`; 'S': the rest of a control period with these torques;
               // 'P': the part of it up to `since_us`, which is not answered
    uint32_t trial;
    uint32_t since_us; // since the period began
    float total, difference;
};
struct PhysicsAnswer {
    float sensed[10]; // in the order of `Sensed`
    float pose[4];    // x, y, heading, tilt; NaN where nothing knows it
};
#pragma pack(pop)

class PhysicsPipe {
public:
    PhysicsPipe(int to, int from, int port) : to_(to), from_(from), port_(port) {}

    bool arm(uint32_t trial)
    {
        is_fresh_ = ask(PhysicsOrder{'R', trial, 0, 0.0f, 0.0f});
        return is_fresh_;
    }

    // Moves while the time passes, so that little is left to do when the control period is over.
    void pass(WheelCommands given, uint32_t since_us)
    {
        tell(PhysicsOrder{'P', 0, since_us, given.total, given.difference});
    }

    Sensed sense(WheelCommands applied, uint8_t, float)
    {
        if (is_fresh_) { // the first look after arming: no time has passed
            is_fresh_ = false;
        } else {
            ask(PhysicsOrder{'S', 0, 0, applied.total, applied.difference});
        }
        Sensed seen;
        memcpy(&seen, answer_.sensed, sizeof answer_.sensed);
        return seen;
    }

    bool pose(twbal_pose_report& report) const
    {
        report.x = answer_.pose[0];
        report.y = answer_.pose[1];
        report.heading = answer_.pose[2];
        report.tilt = answer_.pose[3];
        return !isnan(report.x);
    }

    // To the host, together with what else is said until `flush`: each piece would wake it.
    void write(const uint8_t* bytes, size_t size)
    {
        if (size > sizeof said_ - has_said_) {
            flush();
        }
        memcpy(said_ + has_said_, bytes, size);
        has_said_ += size;
    }

    // What has no room in the line is lost, as on a wire.
    void flush()
    {
        if (has_said_ > 0 && ::write(port_, said_, has_said_) < 0) {
            // lost
        }
        has_said_ = 0;
    }

    bool is_gone() const { return is_gone_; }

private:
    void tell(const PhysicsOrder& order)
    {
        is_gone_ = is_gone_ || ::write(to_, &order, sizeof order) != static_cast<ssize_t>(sizeof order);
    }

    bool ask(const PhysicsOrder& order)
    {
        tell(order);
        size_t have = 0;
        uint8_t* to = reinterpret_cast<uint8_t*>(&answer_);
        while (!is_gone_ && have < sizeof answer_) {
            const ssize_t got = ::read(from_, to + have, sizeof answer_ - have);
            is_gone_ = got <= 0;
            have += is_gone_ ? 0 : static_cast<size_t>(got);
        }
        return !is_gone_;
    }

    int to_, from_, port_;
    bool is_fresh_ = false, is_gone_ = false;
    PhysicsAnswer answer_ = {};
    uint8_t said_[1024];
    size_t has_said_ = 0;
};

static_assert(sizeof(Sensed) == sizeof(PhysicsAnswer::sensed), "Sensed is sent as it is");

} // namespace twbal

#endif
