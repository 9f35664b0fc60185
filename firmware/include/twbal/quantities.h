// What is measured and what is commanded, in SI units. Signs: forward, a lean forward and a turn to the left are positive.
#ifndef TWBAL_QUANTITIES_H
#define TWBAL_QUANTITIES_H

#include <math.h>

namespace twbal {

// A value that the robot does not measure is NaN.
struct Sensed {
    float tilt = NAN;             // [rad]
    float tilt_rate = NAN;        // [rad/s]
    float acceleration = NAN;     // of the axle, mean over the last control period [m/s^2]
    float wheel_angle = NAN;      // mean of both wheels, relative to the body, from where it was armed [rad]
    float wheel_rate = NAN;       // [rad/s]
    float wheel_difference = NAN; // right less left [rad]
    float difference_rate = NAN;  // [rad/s]
    float yaw_rate = NAN;         // [rad/s]
    float heading = NAN;          // from that at arming [rad]
    float battery = NAN;          // [V]
};

// Sum and difference (right less left) of what both wheels get [N m, or V].
struct WheelCommands {
    float total;
    float difference;

    float left() const { return 0.5f * (total - difference); }
    float right() const { return 0.5f * (total + difference); }
};

inline float within(float value, float most)
{
    return value > most ? most : (value < -most ? -most : value);
}

// Balancing goes first: a turn gets what is left of each wheel's half of the largest sum.
struct WheelLimits {
    float total;
    float difference;

    WheelCommands cut(WheelCommands asked) const
    {
        const float sum = within(asked.total, total);
        const float left = total - fabsf(sum);
        return WheelCommands{sum, within(asked.difference, left < difference ? left : difference)};
    }

    bool allow(WheelCommands asked) const
    {
        const WheelCommands done = cut(asked);
        const float rounding = 1e-6f * total;
        return fabsf(done.total - asked.total) <= rounding && fabsf(done.difference - asked.difference) <= rounding;
    }
};

} // namespace twbal

#endif
