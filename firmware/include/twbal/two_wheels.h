// A body of two motors with encoders and an IMU, as the robot's board: filters, encoders and motor model around `Hardware`.
//
// `Hardware` has
//     bool read_imu(ImuSample&);             false where it does not answer
//     int32_t left_count(), right_count();   of the encoders
//     float battery();                       [V]; the nominal voltage where nothing measures it
//     void set_duty(float left, float right); -1 to 1, positive rolls forward; 0: off
//     void write(const uint8_t*, size_t);
#ifndef TWBAL_TWO_WHEELS_H
#define TWBAL_TWO_WHEELS_H

#include <stddef.h>
#include <stdint.h>

#include "twbal/attitude_filter.h"
#include "twbal/motor_model.h"
#include "twbal/protocol_messages.h"
#include "twbal/quantities.h"
#include "twbal/wheel_encoder.h"

namespace twbal {

// Along the body's axes: x forward, z up. Signs as everywhere: a lean forward and a turn to the left are positive.
struct ImuSample {
    float forward, up; // specific force [both in one unit]
    float pitch_rate;  // [rad/s]
    float yaw_rate;    // [rad/s]
};

struct Build {
    Motor motor;          // one of them, as both are alike
    float dead_duty;      // duty below which a motor does not turn, which torques get beside theirs; 0: unknown
    float left_counts;    // of a turn of the wheel; negative where the count falls as it rolls forward
    float right_counts;
    float time_constant;  // of the attitude filter [s]
    float control_period; // [s]
    bool measures_battery;
    float least_battery;  // lower readings are taken for it [V]: by a wrong divider, each duty would be too large
    float motor_voltage;  // most that a motor gets, whatever drives it [V]
};

const uint16_t TWO_WHEELS_SENSORS = TWBAL_SENSORS_TILT | TWBAL_SENSORS_TILT_RATE | TWBAL_SENSORS_WHEEL_ANGLE
    | TWBAL_SENSORS_WHEEL_RATE | TWBAL_SENSORS_WHEEL_DIFFERENCE | TWBAL_SENSORS_DIFFERENCE_RATE | TWBAL_SENSORS_YAW_RATE
    | TWBAL_SENSORS_HEADING;

template <class Hardware>
class TwoWheels {
public:
    TwoWheels(Hardware& hardware, const Build& build)
        : hardware_(hardware), build_(build), filter_(build.time_constant), left_(build.left_counts),
          right_(build.right_counts)
    {
    }

    uint16_t sensors() const
    {
        return static_cast<uint16_t>(TWO_WHEELS_SENSORS | (build_.measures_battery ? TWBAL_SENSORS_BATTERY : 0u));
    }

    // To be called each 2 to 5 ms, `period` [s] after the call before.
    void sample(float period, bool motors_are_on)
    {
        ImuSample seen = before_;
        const bool is_read = hardware_.read_imu(seen);
        // The noise of a living sensor changes its last digit: one that repeats itself has frozen.
        const bool is_same = seen.forward == before_.forward && seen.up == before_.up
            && seen.pitch_rate == before_.pitch_rate && seen.yaw_rate == before_.yaw_rate;
        judge_imu(!is_read || is_same);
        if (!is_read) {
            unread_ += period;
            return;
        }
        before_ = seen;
        period += unread_; // the robot turned meanwhile, too
        unread_ = 0.0f;
        if (!motors_are_on) {
            filter_.rest(seen.pitch_rate, period);
            yaw_bias_.update(seen.yaw_rate, period);
        }
        filter_.update(seen.forward, seen.up, seen.pitch_rate, period);
        yaw_rate_ = seen.yaw_rate - yaw_bias_.bias();
        heading_ += period * yaw_rate_;
    }

    // Give the motors what is commanded; call it after each `sample`, so that the back-EMF is of the present rate.
    void drive(WheelCommands given, uint8_t unit, bool motors_are_on)
    {
        if (!motors_are_on) {
            hardware_.set_duty(0.0f, 0.0f);
            return;
        }
        const float told = hardware_.battery();
        const float battery = told > 1.0f && told < build_.least_battery ? build_.least_battery : told;
        hardware_.set_duty(duty_of(given.left(), left_.rate(), unit, battery),
            duty_of(given.right(), right_.rate(), unit, battery));
    }

    // Below: as `Robot` asks of a board.

    bool arm(uint32_t)
    {
        if (!imu_lives()) {
            return false;
        }
        left_.zero(hardware_.left_count());
        right_.zero(hardware_.right_count());
        heading_ = 0.0f;
        return true;
    }

    Sensed sense(WheelCommands, uint8_t, float elapsed)
    {
        left_.update(hardware_.left_count(), elapsed);
        right_.update(hardware_.right_count(), elapsed);
        Sensed seen;
        seen.tilt = imu_lives() ? filter_.tilt() : NAN;
        seen.tilt_rate = imu_lives() ? filter_.rate() : NAN;
        seen.wheel_angle = 0.5f * (left_.angle() + right_.angle());
        seen.wheel_rate = 0.5f * (left_.rate() + right_.rate());
        seen.wheel_difference = right_.angle() - left_.angle();
        seen.difference_rate = right_.rate() - left_.rate();
        seen.yaw_rate = yaw_rate_;
        seen.heading = heading_;
        if (build_.measures_battery) {
            seen.battery = hardware_.battery();
        }
        return seen;
    }

    bool pose(twbal_pose_report&) const { return false; }
    void write(const uint8_t* bytes, size_t size) { hardware_.write(bytes, size); }

private:
    static constexpr uint8_t FROZEN = 10; // samples in a row: 20 ms at 2 ms
    static constexpr uint8_t MAKES_UP = 2; // odd samples for which a good one makes up: more than 2 of 3 are too many

    bool imu_lives() const { return lives_; }

    // An IMU without which the robot must stop; after that it begins anew, with as many good samples in a row.
    void judge_imu(bool is_odd)
    {
        const uint8_t fewer = lives_ ? MAKES_UP : uint8_t{1};
        if (is_odd && !lives_) {
            odd_samples_ = FROZEN; // good ones are counted anew
        } else if (is_odd) {
            odd_samples_ = static_cast<uint8_t>(odd_samples_ + (odd_samples_ < FROZEN));
        } else {
            odd_samples_ = static_cast<uint8_t>(odd_samples_ > fewer ? odd_samples_ - fewer : 0);
        }
        if (odd_samples_ == FROZEN) {
            lives_ = false;
            unread_ = 0.0f;
            filter_.forget();
        } else if (odd_samples_ == 0) {
            lives_ = true;
        }
    }

    // At a command of exactly 0 the bridge is off: a back-EMF that is too large, by a wrong count or gear, would drive
    // on a wheel that a hand turns. The dead duty has the sign of the torque, so that it never drives on what brakes. A
    // voltage is put out as it is. No motor gets more than its voltage, of a battery of more.
    float duty_of(float command, float rate, uint8_t unit, float battery) const
    {
        const float most = duty(build_.motor_voltage, battery);
        if (unit == TWBAL_DRIVE_VOLTAGE) {
            return within(duty(command, battery), most);
        }
        const float supply = battery < build_.motor_voltage ? battery : build_.motor_voltage;
        const float share = within(duty(build_.motor.voltage(command, rate, supply), battery), most);
        if (command == 0.0f || share == 0.0f) { // share: also where the command or the battery is no number
            return 0.0f;
        }
        const float least = command > 0.0f ? build_.dead_duty : -build_.dead_duty;
        return within(share * (1.0f - build_.dead_duty) + least, most);
    }

    Hardware& hardware_;
    const Build& build_;
    AttitudeFilter filter_;
    WheelEncoder left_, right_;
    ImuSample before_ = {0.0f, 1.0f, 0.0f, 0.0f};
    float heading_ = 0.0f, yaw_rate_ = 0.0f;
    float unread_ = 0.0f; // since the IMU was last read [s]
    RestingBias yaw_bias_;
    uint8_t odd_samples_ = FROZEN;
    bool lives_ = false; // until it was read some times
};

} // namespace twbal

#endif
