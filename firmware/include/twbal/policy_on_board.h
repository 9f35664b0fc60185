// The exported policy (policy.h of `twbal export-policy`) as the robot drives by it, with the heading loop beside it.
#ifndef TWBAL_POLICY_ON_BOARD_H
#define TWBAL_POLICY_ON_BOARD_H

#include "policy.h"
#include "twbal/heading_loop.h"
#include "twbal/protocol_messages.h"
#include "twbal/quantities.h"

namespace twbal {

static_assert(TWBAL_POLICY_VERSION == 2, "policy.h is of another version of twbal: export the policy again");

// Whether the policy is of a control period; for static_assert in board files.
constexpr bool policy_is_of_period(float microseconds)
{
    return TWBAL_POLICY_CONTROL_PERIOD * 1e6f - microseconds < 1.0f
        && microseconds - TWBAL_POLICY_CONTROL_PERIOD * 1e6f < 1.0f;
}

class PolicyOnBoard {
public:
    explicit PolicyOnBoard(const HeadingLoop& heading) : heading_(heading) { reset(); }

    void reset() { twbal_policy_reset(&memory_); }

    WheelCommands step(const Sensed& seen, float period, const twbal_follow& order)
    {
        const twbal_observation observation = {period, seen.tilt, seen.tilt_rate, or_zero(seen.acceleration),
            seen.wheel_angle, seen.wheel_rate, or_zero(seen.yaw_rate)};
        const twbal_reference reference = {order.position, order.speed, order.gives_way};
        const float total = twbal_policy_step(&memory_, &observation, &reference);
        return WheelCommands{total, heading_.difference(order.heading - seen.heading, order.yaw_rate - seen.yaw_rate)};
    }

private:
    static float or_zero(float value) { return isnan(value) ? 0.0f : value; }

    HeadingLoop heading_;
    twbal_policy_memory memory_;
};

} // namespace twbal

#endif
