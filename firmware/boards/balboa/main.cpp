// Balboa 32U4 of Pololu with its own IMU (LSM6DS33), encoders and motors, by Pololu's library Balboa32U4. Its USB port is
// the line. What differs from robot to robot is at the top.
#include <Arduino.h>
#include <Balboa32U4.h>
#include <Wire.h>
#include <avr/wdt.h>
#include <string.h>

#include "../arduino_loop.h"
#include "../imu_registers.h"

#ifdef TWBAL_WITH_POLICY
#include "twbal/policy_on_board.h"
#else
#define TWBAL_POLICY_ID 0u
#endif

namespace {

// conf/robot/balboa.yaml: 80 mm wheels, gears of 110.1.
const char ROBOT_NAME[] = "balboa";
const uint32_t CONTROL_PERIOD_US = 10000;
#ifdef TWBAL_WITH_POLICY
static_assert(twbal::policy_is_of_period(CONTROL_PERIOD_US), "the policy on board is of another control period");
#endif
const float TORQUE_LIMIT = 1.99f, DIFFERENCE_LIMIT = 0.5f, TILT_LIMIT = 1.0f;
const float MOTOR_VOLTAGE_LIMIT = 7.2f;
const float COUNTS = 12.0f * 110.1f; // of a turn of the wheel
const float LEFT_COUNTS = COUNTS, RIGHT_COUNTS = COUNTS; // negative where the count falls as the wheel rolls forward
const bool LEFT_REVERSED = false, RIGHT_REVERSED = false; // motors that are not wired in Pololu's way
// On the upright Balboa x of its IMU points up, y to the left and z backward, by the signs of Pololu's example Balancer.
// They were not seen on a robot: see the first check of docs/firmware.md.
const float FORWARD_SIGN = -1.0f, LEFT_SIGN = 1.0f, UP_SIGN = 1.0f;
const twbal::Build BUILD = {{2.70f, 3.2e-3f, 110.1f}, 0.0f, LEFT_COUNTS, RIGHT_COUNTS, 0.5f, 0.01f, true, 5.0f,
    MOTOR_VOLTAGE_LIMIT};

const uint8_t IMU = 0x6B;
const twbal::ImuRegister IMU_REGISTERS[] = {
    {0x10, 0x58}, // acceleration: 208 Hz, 4 g
    {0x11, 0x54}, // gyro: 208 Hz, 500 degrees/s
    {0x12, 0x04}, // addresses go on by themselves
};
const float GYRO_UNIT = 17.5e-3f * 0.01745329f; // at 500 degrees/s [rad/s]

class Hardware {
public:
    void begin()
    {
        Wire.begin();
        Wire.setClock(400000);
        Wire.setWireTimeout(3000, true); // us; a bus that hangs must not hold the loop
        Balboa32U4Motors::allowTurbo(true); // else its library cuts each duty to 0.75
        Balboa32U4Motors::flipLeftMotor(LEFT_REVERSED);
        Balboa32U4Motors::flipRightMotor(RIGHT_REVERSED);
    }

    // False, also, until the IMU is set up; and it is set up anew where it did not answer, as it may have started anew.
    bool read_imu(twbal::ImuSample& seen)
    {
        is_set_up_ = is_set_up_ || twbal::set_up(IMU, IMU_REGISTERS);
        if (!is_set_up_) {
            return false;
        }
        Wire.beginTransmission(IMU);
        Wire.write(0x22);
        if (Wire.endTransmission(false) != 0 || Wire.requestFrom(IMU, static_cast<uint8_t>(12)) != 12) {
            is_set_up_ = false;
            return false;
        }
        int16_t raw[6]; // rates, accelerations
        for (int16_t& value : raw) {
            const int low = Wire.read();
            value = static_cast<int16_t>((Wire.read() << 8) | low);
        }
        seen.forward = FORWARD_SIGN * static_cast<float>(raw[5]);
        seen.up = UP_SIGN * static_cast<float>(raw[3]);
        seen.pitch_rate = LEFT_SIGN * GYRO_UNIT * static_cast<float>(raw[1]); // about the axis to the left
        seen.yaw_rate = UP_SIGN * GYRO_UNIT * static_cast<float>(raw[0]);
        return true;
    }

    // The library counts in 16 bits, which overflow; read often, they add up.
    int32_t left_count() { return left_ += encoders_.getCountsAndResetLeft(); }
    int32_t right_count() { return right_ += encoders_.getCountsAndResetRight(); }
    float battery() const { return 1e-3f * static_cast<float>(readBatteryMillivolts()); }

    void set_duty(float left, float right)
    {
        motors_.setSpeeds(static_cast<int16_t>(400.0f * left), static_cast<int16_t>(400.0f * right));
    }

    // What the host does not read fast enough is left out by whole frames, so that it does not hold the loop.
    void write(const uint8_t* bytes, size_t size)
    {
        if (size <= sizeof waiting_ - waits_) {
            memcpy(waiting_ + waits_, bytes, size);
            waits_ += size;
        }
        send_waiting();
    }

    // USB has room for 64 bytes at a time, and a frame of telemetry has 71: the rest goes in the next turns of the loop.
    // A byte of the room stays free, as Arduino waits for the host after a packet that is full.
    void send_waiting()
    {
        size_t sent = 0;
        for (int room = Serial.availableForWrite() - 1; room > 0 && sent < waits_;
             room = Serial.availableForWrite() - 1) {
            const size_t left = waits_ - sent, part = left < static_cast<size_t>(room) ? left : static_cast<size_t>(room);
            Serial.write(waiting_ + sent, part);
            sent += part;
        }
        waits_ -= sent;
        memmove(waiting_, waiting_ + sent, waits_);
    }

    void forget_waiting() { waits_ = 0; }

private:
    Balboa32U4Motors motors_;
    Balboa32U4Encoders encoders_;
    int32_t left_ = 0, right_ = 0;
    uint8_t waiting_[144]; // two frames of telemetry
    size_t waits_ = 0;
    bool is_set_up_ = false;
};

Hardware hardware;
twbal::TwoWheels<Hardware> body(hardware, BUILD);
const twbal::Identity ME = {ROBOT_NAME, CONTROL_PERIOD_US, TORQUE_LIMIT, DIFFERENCE_LIMIT, MOTOR_VOLTAGE_LIMIT,
    TILT_LIMIT, TWBAL_CLOCK_REAL_TIME, body.sensors(), TWBAL_POLICY_ID, twbal::build_number(__DATE__ __TIME__),
    {TWBAL_WATCHDOG_US, TWBAL_ON_BOARD_WATCHDOG_US}};
#ifdef TWBAL_WITH_POLICY
twbal::PolicyOnBoard policy(twbal::HeadingLoop{4.3e-4f, 0.107f, 0.04f, 3.0f});
#else
twbal::NoPolicy policy;
#endif
twbal::Robot<decltype(body), decltype(policy)> robot(ME, body, policy);
twbal::ArduinoLoop<decltype(body), decltype(robot), decltype(Serial)> cycle(body, robot, Serial);

} // namespace

void setup()
{
    Serial.begin(921600);
    hardware.begin();
    wdt_enable(WDTO_120MS); // a loop that hangs resets the board, whose motors are then off
}

void loop()
{
    wdt_reset();
    if (!Serial.dtr()) { // no host has the port open
        robot.port_closed();
        hardware.forget_waiting();
    }
    cycle.turn();
    hardware.send_waiting();
}
