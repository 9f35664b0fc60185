// Tilt from gyro and accelerometer: a complementary filter; and the bias of a gyro, learned while the robot stands still.
#ifndef TWBAL_ATTITUDE_FILTER_H
#define TWBAL_ATTITUDE_FILTER_H

#include <math.h>

namespace twbal {

// Bias of a gyro: its mean, once it has been still for a second. A robot that is turned by hand is not still.
class RestingBias {
public:
    void update(float rate, float period)
    {
        mean_ += period / (MEMORY + period) * (rate - mean_);
        const bool is_still = fabsf(rate - mean_) < STILL && fabsf(mean_) < LARGEST;
        still_ = is_still ? still_ + period : 0.0f;
        if (still_ > 1.0f) {
            bias_ = mean_;
            still_ = 1.0f + period; // it goes on; no overflow
        }
    }

    float bias() const { return bias_; } // [rad/s]

private:
    static constexpr float LARGEST = 0.2f; // rad/s; of cheap gyros 0.17 at most
    static constexpr float STILL = 0.03f;  // rad/s; noise is below
    static constexpr float MEMORY = 0.2f;  // s

    float mean_ = 0.0f, bias_ = 0.0f, still_ = 0.0f;
};

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
        rate_ = rate - bias_.bias();
        const float share = period / (time_constant_ + period);
        tilt_ = (1.0f - share) * (tilt_ + rate_ * period) + share * felt;
    }

    // Begin anew at the next sample: the robot may be anywhere by then.
    void forget() { settled_ = false; }

    // While the motors are off.
    void rest(float rate, float period) { bias_.update(rate, period); }

    float tilt() const { return tilt_; }
    float rate() const { return rate_; }
    float bias() const { return bias_.bias(); }

private:
    float time_constant_;
    float tilt_ = 0.0f, rate_ = 0.0f;
    RestingBias bias_;
    bool settled_ = false;
};

} // namespace twbal

#endif
