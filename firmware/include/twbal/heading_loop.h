// Difference of the wheel torques that turns the robot to a heading.
#ifndef TWBAL_HEADING_LOOP_H
#define TWBAL_HEADING_LOOP_H

#include "twbal/quantities.h"

namespace twbal {

// Second-order: inertia * (bandwidth^2 error + 2 bandwidth damping) as yaw torque, which the wheels make on half a track.
struct HeadingLoop {
    float inertia;      // of the whole robot about the vertical [kg m^2]
    float track;        // between the middles of the wheels [m]
    float wheel_radius; // [m]
    float bandwidth;    // [rad/s]

    float difference(float heading_error, float rate_error) const
    {
        if (!isfinite(heading_error) || !isfinite(rate_error)) {
            return 0.0f;
        }
        const float pi = 3.14159265f;
        const float turned = within(heading_error, pi); // a large error turns no faster
        const float torque = inertia * (bandwidth * bandwidth * turned + 2.0f * bandwidth * rate_error);
        return 2.0f * torque * wheel_radius / track;
    }
};

} // namespace twbal

#endif
