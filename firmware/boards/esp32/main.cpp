// ESP32 DevKit, MPU6050, and a TB6612 or L298N bridge with two geared motors. Edit robot_config.h, not this file.
#include <Arduino.h>
#include <Wire.h>
#include <esp_task_wdt.h>

#include "../arduino_loop.h"
#include "../imu_registers.h"
#include "robot_config.h"

#ifdef TWBAL_WITH_POLICY
#include "twbal/policy_on_board.h"
static_assert(twbal::policy_is_of_period(CONTROL_PERIOD_US), "the policy on board is of another control period");
#else
#define TWBAL_POLICY_ID 0u
#endif

namespace {

volatile int32_t left_counted = 0, right_counted = 0;

void IRAM_ATTR on_left() { left_counted += digitalRead(LEFT_A) == digitalRead(LEFT_B) ? 1 : -1; }
void IRAM_ATTR on_right() { right_counted += digitalRead(RIGHT_A) == digitalRead(RIGHT_B) ? 1 : -1; }

const uint8_t IMU = 0x68;
const twbal::ImuRegister IMU_REGISTERS[] = {
    {0x6B, 0x01}, // awake, clock of the gyro
    {0x1A, 0x02}, // low-pass at 94 Hz
    {0x1B, 0x08}, // 500 degrees/s
    {0x1C, 0x08}, // 4 g
};
const float GYRO_UNIT = 500.0f / 32768.0f * 0.01745329f; // at 500 degrees/s [rad/s]

class Hardware {
public:
    void begin()
    {
        const int outputs[] = {LEFT_IN1, LEFT_IN2, RIGHT_IN1, RIGHT_IN2};
        for (int pin : outputs) {
            pinMode(pin, OUTPUT);
            digitalWrite(pin, LOW);
        }
        attach_pwm(LEFT_PWM, 0);
        attach_pwm(RIGHT_PWM, 1);
        if (STANDBY >= 0) {
            pinMode(STANDBY, OUTPUT);
            digitalWrite(STANDBY, HIGH);
        }
        Wire.begin(SDA_PIN, SCL_PIN);
        Wire.setClock(400000);
        Wire.setTimeOut(3); // ms; a bus that hangs must not hold the loop
        const int inputs[] = {LEFT_A, LEFT_B, RIGHT_A, RIGHT_B};
        for (int pin : inputs) {
            pinMode(pin, INPUT);
        }
        attachInterrupt(digitalPinToInterrupt(LEFT_A), on_left, CHANGE);
        attachInterrupt(digitalPinToInterrupt(RIGHT_A), on_right, CHANGE);
    }

    // False, also, until the IMU is set up; and it is set up anew where it did not answer, as it may have started anew.
    bool read_imu(twbal::ImuSample& seen)
    {
        is_set_up_ = is_set_up_ || twbal::set_up(IMU, IMU_REGISTERS);
        if (!is_set_up_) {
            return false;
        }
        Wire.beginTransmission(IMU);
        Wire.write(0x3B);
        if (Wire.endTransmission(false) != 0 || Wire.requestFrom(IMU, static_cast<uint8_t>(14)) != 14) {
            is_set_up_ = false;
            return false;
        }
        int16_t raw[7]; // accelerations, temperature, rates
        for (int16_t& value : raw) {
            const int high = Wire.read();
            value = static_cast<int16_t>((high << 8) | Wire.read());
        }
        const int16_t *force = raw, *rate = raw + 4;
        seen.forward = FORWARD_SIGN * static_cast<float>(force[FORWARD_AXIS]);
        seen.up = UP_SIGN * static_cast<float>(force[UP_AXIS]);
        seen.pitch_rate = LEFT_SIGN * GYRO_UNIT * static_cast<float>(rate[LEFT_AXIS]); // about the axis to the left
        seen.yaw_rate = UP_SIGN * GYRO_UNIT * static_cast<float>(rate[UP_AXIS]);
        return true;
    }

    int32_t left_count() const { return left_counted; } // read at once on 32 bits
    int32_t right_count() const { return right_counted; }

    float battery() const
    {
        return BATTERY_PIN < 0 ? NOMINAL_BATTERY
                               : BATTERY_DIVIDER * 1e-3f * static_cast<float>(analogReadMilliVolts(BATTERY_PIN));
    }

    void set_duty(float left, float right)
    {
        set_wheel(LEFT_REVERSED ? -left : left, LEFT_PWM, 0, LEFT_IN1, LEFT_IN2);
        set_wheel(RIGHT_REVERSED ? -right : right, RIGHT_PWM, 1, RIGHT_IN1, RIGHT_IN2);
    }

    void write(const uint8_t* bytes, size_t size) { Serial.write(bytes, size); }

private:
    static const int PWM_BITS = 10, PWM_HZ = 20000;

    static void attach_pwm(int pin, int channel)
    {
#if ESP_ARDUINO_VERSION_MAJOR >= 3
        (void)channel;
        ledcAttach(static_cast<uint8_t>(pin), PWM_HZ, PWM_BITS);
#else
        ledcSetup(static_cast<uint8_t>(channel), PWM_HZ, PWM_BITS);
        ledcAttachPin(static_cast<uint8_t>(pin), static_cast<uint8_t>(channel));
#endif
    }

    static void set_wheel(float duty, int pwm, int channel, int in1, int in2)
    {
        digitalWrite(static_cast<uint8_t>(in1), duty > 0.0f ? HIGH : LOW);
        digitalWrite(static_cast<uint8_t>(in2), duty < 0.0f ? HIGH : LOW);
        const uint32_t share = static_cast<uint32_t>(fabsf(duty) * ((1 << PWM_BITS) - 1));
#if ESP_ARDUINO_VERSION_MAJOR >= 3
        (void)channel;
        ledcWrite(static_cast<uint8_t>(pwm), share);
#else
        (void)pwm;
        ledcWrite(static_cast<uint8_t>(channel), share);
#endif
    }

    bool is_set_up_ = false;
};

const twbal::Build BUILD = {MOTOR, DEAD_DUTY, LEFT_COUNTS, RIGHT_COUNTS, 0.5f, 1e-6f * CONTROL_PERIOD_US,
    BATTERY_PIN >= 0, 0.7f * NOMINAL_BATTERY, MOTOR_VOLTAGE_LIMIT};

Hardware hardware;
twbal::TwoWheels<Hardware> body(hardware, BUILD);
const twbal::Identity ME = {ROBOT_NAME, CONTROL_PERIOD_US, TORQUE_LIMIT, DIFFERENCE_LIMIT, MOTOR_VOLTAGE_LIMIT,
    TILT_LIMIT, TWBAL_CLOCK_REAL_TIME, body.sensors(), TWBAL_POLICY_ID, twbal::build_number(__DATE__ __TIME__),
    {TWBAL_WATCHDOG_US, TWBAL_ON_BOARD_WATCHDOG_US}};
#ifdef TWBAL_WITH_POLICY
twbal::PolicyOnBoard policy(twbal::HeadingLoop{YAW_INERTIA, TRACK, WHEEL_RADIUS, 3.0f});
#else
twbal::NoPolicy policy;
#endif
twbal::Robot<decltype(body), decltype(policy)> robot(ME, body, policy);
twbal::ArduinoLoop<decltype(body), decltype(robot), decltype(Serial)> cycle(body, robot, Serial);

// A loop that hangs resets the board, whose pins are then off. Left alone, Arduino waits for 5 s.
void watch_loop()
{
#if ESP_ARDUINO_VERSION_MAJOR >= 3
    const esp_task_wdt_config_t config = {200, 0, true}; // ms; idle tasks are not watched; reset
    esp_task_wdt_reconfigure(&config);
#else
    esp_task_wdt_init(1, true); // s, the least that there is
#endif
    enableLoopWDT();
}

} // namespace

void setup()
{
    hardware.begin(); // first, as it holds the motors off
    Serial.setRxBufferSize(1024);
    Serial.begin(921600);
    watch_loop();
}

void loop() { cycle.turn(); }
