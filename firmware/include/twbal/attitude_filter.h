// Tilt from gyro and accelerometer: a complementary filter. While the robot is held still before it is armed, the gyro's
// bias is learned; a gyro that is not still changes nothing.
#ifndef TWBAL_ATTITUDE_FILTER_H
#define TWBAL_ATTITUDE_FILTER_H

#include <math.h>

namespace twbal {

class AttitudeFilter {
public:
    // `time_constant`: below it the gyro tells the tilt, above it the accelerometer [s].
    explicit AttitudeFilter(float time_constant) : time_constant_(time_constant) {}

    // Forward and up: specific force along the body's axes, in any unit [both the same]; rate of the gyro [rad/s].
    void update(float forward, float up, float rate, float period)
    {
        const float felt = atan2f(-forward, up); // at rest a body that leans forward feels a force backward
        if (!settled_) {
            tilt_ = felt;
            settled_ = true;
        }
        rate_ = rate - bias_;
        const float share = period / (time_constant_ + period);
        tilt_ = (1.0f - share) * (tilt_ + rate_ * period) + share * felt;
    }

    // While the motors are off: take what the gyro says for its bias, if it is small.
    void rest(float rate, float period)
    {
        if (fabsf(rate) < LARGEST_BIAS) {
            bias_ += period / REST_TIME * (rate - bias_);
        }
    }

    float tilt() const { return tilt_; }
    float rate() const { return rate_; }
    float bias() const { return bias_; }

private:
    static constexpr float LARGEST_BIAS = 0.2f; // rad/s; of cheap gyros 0.17 at most
    static constexpr float REST_TIME = 0.5f;    // s

    float time_constant_;
    float tilt_ = 0.0f, rate_ = 0.0f, bias_ = 0.0f;
    bool settled_ = false;
};

} // namespace twbal

#endif
