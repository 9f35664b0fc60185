// Angle and rate of a wheel from its encoder's count. The count may overflow.
#ifndef TWBAL_WHEEL_ENCODER_H
#define TWBAL_WHEEL_ENCODER_H

#include <stdint.h>

namespace twbal {

class WheelEncoder {
public:
    // `counts_per_turn`: of the wheel, all edges that are counted; negative where the count falls as it rolls forward.
    explicit WheelEncoder(float counts_per_turn) : radian_(6.2831853f / counts_per_turn) {}

    // Begin a rollout: the angle is 0 here.
    void zero(int32_t count)
    {
        before_ = count;
        total_ = 0;
        rate_ = 0.0f;
    }

    // The count after another `period` [s].
    void update(int32_t count, float period)
    {
        const int32_t steps = static_cast<int32_t>(static_cast<uint32_t>(count) - static_cast<uint32_t>(before_));
        before_ = count;
        total_ += steps;
        rate_ = period > 0.0f ? radian_ * static_cast<float>(steps) / period : 0.0f;
    }

    float angle() const { return radian_ * static_cast<float>(total_); } // [rad]
    float rate() const { return rate_; }                                // mean over the last period [rad/s]

private:
    float radian_;
    int32_t before_ = 0, total_ = 0;
    float rate_ = 0.0f;
};

} // namespace twbal

#endif
