// Parts that need no host: known answers, limits and models. Exit code 0: all hold.
#include <stdio.h>

#include "fake_board.h"
#include "twbal/attitude_filter.h"
#include "twbal/heading_loop.h"
#include "twbal/motor_model.h"
#include "twbal/two_wheels.h"
#include "twbal/wheel_encoder.h"

static int failed = 0;

static void check(bool holds, const char* what)
{
    if (!holds) {
        printf("FAILED: %s\n", what);
        ++failed;
    }
}

static float within_one(float value) { return twbal::within(value, 1.0f); }

static bool near(float a, float b, float tolerance) { return fabsf(a - b) <= tolerance; }

struct Kept {
    uint8_t bytes[512];
    size_t size = 0;
    void write(const uint8_t* from, size_t count)
    {
        memcpy(bytes, from, count);
        size = count;
    }
};

static void frames()
{
    const uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    check(twbal::crc16(digits, 9) == 0x29B1, "CRC of 123456789");
    Kept line;
    const uint8_t stop[] = {0x04, 0x01, 0x00}, wire[] = {0x00, 0x03, 0x04, 0x01, 0x03, 0x6D, 0x23, 0x00};
    twbal::write_frame(line, stop, 3);
    check(line.size == 8 && memcmp(line.bytes, wire, 8) == 0, "Stop as docs/protocol.md shows it");
    for (size_t size = 1; size <= 250; ++size) { // what COBS adds, and all lengths
        uint8_t payload[250];
        for (size_t k = 0; k < size; ++k) {
            payload[k] = static_cast<uint8_t>((k * size) % 7 == 3 ? 0 : k + 1);
        }
        twbal::write_frame(line, payload, size);
        twbal::FrameReader reader;
        int found = 0;
        for (size_t k = 0; k < line.size; ++k) {
            found += reader.feed(line.bytes[k]);
        }
        check(found == 1 && reader.size() == size && memcmp(reader.payload(), payload, size) == 0, "round trip");
    }
}

static void limits()
{
    const twbal::WheelLimits most = {20.0f, 20.0f};
    check(most.cut({5.0f, -14.0f}).difference == -14.0f, "a turn within what is left");
    check(most.cut({-18.0f, 3.0f}).difference == 2.0f, "balancing goes first");
    check(most.cut({25.0f, 3.0f}).total == 20.0f && most.cut({25.0f, 3.0f}).difference == 0.0f, "the sum is cut");
    check(!most.allow({25.0f, 0.0f}) && most.allow({5.0f, 3.0f}), "what is cut is known");
    const twbal::WheelCommands both = {6.0f, 2.0f};
    check(both.left() == 2.0f && both.right() == 4.0f, "left and right");
}

static void motors()
{
    const twbal::Motor motor = {2.7f, 3.2e-3f, 110.1f};
    const float stall = motor.voltage(0.5f, 0.0f, 7.2f), driven = motor.voltage(0.5f, 10.0f, 7.2f);
    check(near(stall, 0.5f * 2.7f / (110.1f * 3.2e-3f), 1e-4f), "voltage at a standstill");
    check(near(driven - stall, 110.1f * 3.2e-3f * 10.0f, 1e-3f), "back-EMF");
    check(near(110.1f * 3.2e-3f * (driven - 110.1f * 3.2e-3f * 10.0f) / 2.7f, 0.5f, 1e-4f), "and back to the torque");
    check(near(motor.voltage(-0.5f, 100.0f, 7.2f), 7.2f - stall, 1e-4f), "no back-EMF beyond the supply");
    check(twbal::duty(3.0f, 6.0f) == 0.5f && twbal::duty(-30.0f, 6.0f) == -1.0f, "duty");
    check(twbal::duty(3.0f, NAN) == 0.0f && twbal::duty(NAN, 6.0f) == 0.0f && twbal::duty(3.0f, 0.0f) == 0.0f,
        "no duty without numbers");
}

static void attitude()
{
    const float period = 0.002f, lean = 0.3f, bias = 0.05f;
    twbal::AttitudeFilter filter(0.5f);
    for (int k = 0; k < 2000; ++k) { // held still: the bias is learned
        filter.update(-sinf(lean), cosf(lean), bias, period);
        filter.rest(bias, period);
    }
    check(near(filter.tilt(), lean, 0.002f), "tilt at rest, forward is positive");
    check(near(filter.bias(), bias, 0.001f) && near(filter.rate(), 0.0f, 0.001f), "bias of the gyro");
    float tilt = lean;
    for (int k = 0; k < 200; ++k) { // falls forward at 1 rad/s; what the accelerometer feels is disturbed
        tilt += period;
        filter.update(-sinf(tilt) + 0.1f * (k % 2 ? 1.0f : -1.0f), cosf(tilt), 1.0f + bias, period);
    }
    check(near(filter.tilt(), tilt, 0.02f) && near(filter.rate(), 1.0f, 0.01f), "tilt in motion");
    twbal::RestingBias turned, held;
    for (int k = 0; k < 5000; ++k) {
        turned.update(0.5f, period);
        held.update(bias + 0.1f * sinf(6.2831853f * period * static_cast<float>(k)), period);
    }
    check(turned.bias() == 0.0f && held.bias() == 0.0f, "a gyro that is turned by hand has no bias to learn");
}

static void encoders()
{
    twbal::WheelEncoder wheel(1320.0f);
    wheel.zero(2147483640);
    wheel.update(-2147483646, 0.01f); // 10 counts on, over the end of 32 bits
    check(near(wheel.angle(), 10.0f * 6.2831853f / 1320.0f, 1e-6f), "angle over an overflow");
    check(near(wheel.rate(), wheel.angle() / 0.01f, 1e-3f), "rate");
    twbal::WheelEncoder mirrored(-1320.0f);
    mirrored.zero(0);
    mirrored.update(132, 0.01f);
    check(near(mirrored.angle(), -0.62831853f, 1e-5f), "an encoder that counts backward");
}

// A body with this inertia turns to its heading and stays there.
static void heading()
{
    const twbal::HeadingLoop loop = {0.02f, 0.2f, 0.04f, 4.0f};
    float angle = 0.0f, rate = 0.0f;
    for (int k = 0; k < 400; ++k) {
        const float difference = loop.difference(1.0f - angle, 0.0f - rate);
        rate += 0.01f * difference / loop.wheel_radius * loop.track / 2.0f / loop.inertia;
        angle += 0.01f * rate;
        check(angle < 1.01f, "no overshoot");
    }
    check(near(angle, 1.0f, 0.01f), "it reaches its heading");
    check(loop.difference(NAN, 0.0f) == 0.0f, "no turn without a heading");
}

// A robot on a bench: what its sensors say is set, what its bridges put out is kept.
struct Bench {
    twbal::ImuSample imu = {0.0f, 1.0f, 0.0f, 0.0f};
    bool answers = true;
    int32_t left = 0, right = 0;
    float volts = 12.0f, left_duty = 9.0f, right_duty = 9.0f;
    bool read_imu(twbal::ImuSample& seen)
    {
        imu.yaw_rate += 1e-6f; // noise
        seen = imu;
        return answers;
    }
    int32_t left_count() const { return left; }
    int32_t right_count() const { return right; }
    float battery() const { return volts; }
    void set_duty(float l, float r)
    {
        left_duty = l;
        right_duty = r;
    }
    void write(const uint8_t*, size_t) {}
};

static void body()
{
    const twbal::Build build = {{6.0f, 0.01f, 30.0f}, 0.0f, 660.0f, -660.0f, 0.5f, 0.01f, true, 8.0f, 24.0f};
    const twbal::WheelCommands none = {0.0f, 0.0f};
    Bench bench;
    twbal::TwoWheels<Bench> wheels(bench, build);
    check(!wheels.arm(0), "a robot whose IMU was never read does not arm");
    bench.imu.forward = -sinf(0.2f);
    bench.imu.up = cosf(0.2f);
    wheels.sample(0.002f, false);
    check(!wheels.arm(0), "nor does one whose IMU was read once");
    for (int k = 0; k < 100; ++k) {
        wheels.sample(0.002f, false);
    }
    check(wheels.arm(0) && near(wheels.sense(none, 0, 0.0f).tilt, 0.2f, 0.001f), "tilt at arming");
    bench.left = 66;
    bench.right = -132; // counts backward, and rolls forward
    const twbal::Sensed seen = wheels.sense(none, 0, 0.01f);
    const float turn = 6.2831853f;
    check(near(seen.wheel_angle, 0.15f * turn, 1e-4f) && near(seen.wheel_difference, 0.1f * turn, 1e-4f), "wheels");
    check(near(seen.wheel_rate, 15.0f * turn, 1e-2f) && seen.battery == 12.0f && isnan(seen.acceleration), "the rest");
    wheels.drive(twbal::WheelCommands{0.4f, 0.0f}, TWBAL_DRIVE_TORQUE, true);
    const float left = (0.2f * 6.0f / 0.3f + 0.3f * 10.0f * turn) / 12.0f;
    check(near(bench.left_duty, within_one(left), 1e-4f), "torque and back-EMF make the duty");
    wheels.drive(twbal::WheelCommands{12.0f, 0.0f}, TWBAL_DRIVE_VOLTAGE, true);
    check(near(bench.left_duty, 0.5f, 1e-6f) && near(bench.right_duty, 0.5f, 1e-6f), "voltage makes it alone");
    wheels.drive(twbal::WheelCommands{NAN, 0.0f}, TWBAL_DRIVE_TORQUE, true);
    check(bench.left_duty == 0.0f && bench.right_duty == 0.0f, "no number, no duty");
    bench.volts = 3.0f;
    wheels.drive(twbal::WheelCommands{12.0f, 0.0f}, TWBAL_DRIVE_VOLTAGE, true);
    check(near(bench.left_duty, 0.75f, 1e-6f), "a battery that cannot be so low makes no larger duty");
    bench.volts = 0.5f;
    wheels.drive(twbal::WheelCommands{12.0f, 0.0f}, TWBAL_DRIVE_VOLTAGE, true);
    check(bench.left_duty == 0.0f, "no battery, no duty");
    bench.volts = 12.0f;
    bench.left_duty = 1.0f;
    wheels.drive(twbal::WheelCommands{12.0f, 0.0f}, TWBAL_DRIVE_VOLTAGE, false);
    check(bench.left_duty == 0.0f, "off is off");
    bench.answers = false;
    for (int k = 0; k < 300; ++k) {
        wheels.sample(0.002f, true);
    }
    check(isnan(wheels.sense(none, 0, 0.01f).tilt) && !wheels.arm(0), "an IMU that does not answer has no tilt");
    bench.answers = true;
    bench.imu.forward = sinf(0.5f); // somebody has turned it meanwhile
    bench.imu.up = cosf(0.5f);
    wheels.sample(0.002f, false);
    check(!wheels.arm(0), "nor after one answer");
    for (int k = 0; k < 10; ++k) {
        wheels.sample(0.002f, false);
    }
    check(wheels.arm(0) && near(wheels.sense(none, 0, 0.01f).tilt, -0.5f, 0.001f), "and has one again, of where it is");
    for (int k = 0; k < 20; ++k) {
        bench.imu.yaw_rate -= 1e-6f;
        wheels.sample(0.002f, true);
    }
    check(isnan(wheels.sense(none, 0, 0.01f).tilt), "an IMU that repeats itself is frozen");
}

// An IMU that failed, and of which each third reading still does: ten good ones in a row let the robot be armed again.
static void after_a_failure()
{
    const twbal::Build build = {{6.0f, 0.01f, 30.0f}, 0.0f, 660.0f, -660.0f, 0.5f, 0.01f, true, 8.0f, 24.0f};
    Bench bench;
    twbal::TwoWheels<Bench> wheels(bench, build);
    bool armed = false;
    for (int k = 0; k < 300; ++k) {
        bench.answers = k % 3 != 2;
        wheels.sample(0.002f, false);
        armed = armed || wheels.arm(0);
    }
    check(!armed, "two good readings in three do not let a robot be armed whose IMU has failed");
    for (int k = 1; k <= 10; ++k) {
        bench.answers = true;
        wheels.sample(0.002f, false);
        check(wheels.arm(0) == (k == 10), "ten good ones in a row do");
    }
}

// A body that turns at 2 rad/s for 0.3 s while the IMU answers only each `every`th time: the tilt that it says.
static float turned(int every)
{
    const twbal::Build build = {{6.0f, 0.01f, 30.0f}, 0.0f, 660.0f, -660.0f, 0.5f, 0.01f, true, 8.0f, 24.0f};
    Bench bench;
    twbal::TwoWheels<Bench> wheels(bench, build);
    for (int k = 0; k < 100; ++k) {
        wheels.sample(0.002f, false);
    }
    for (int k = 1; k <= 150; ++k) {
        const float tilt = 2.0f * 0.002f * static_cast<float>(k);
        bench.imu = {-sinf(tilt), cosf(tilt), 2.0f, bench.imu.yaw_rate};
        bench.answers = k % every == 0;
        wheels.sample(0.002f, true);
    }
    return wheels.sense(twbal::WheelCommands{0.0f, 0.0f}, 0, 0.01f).tilt;
}

static void unread()
{
    check(near(turned(1), 0.6f, 0.01f), "a body that turns");
    check(near(turned(2), 0.6f, 0.02f) && near(turned(3), 0.6f, 0.02f), "readings that are lost lose no motion");
    check(isnan(turned(4)) && isnan(turned(10)), "an IMU that answers only now and then stops the robot");
}

// A wheel in the air behind a gear motor, the left one of a bench: a hand turns it forward at 1 turn/s for a second and
// lets it go. Rates are 10 ms apart, commands 2 ms, as on a board. Returns how fast it turns 4 s later [rad/s].
static float let_go(const twbal::Build& believed, float command)
{
    const float resistance = 7.0f, constant = 0.0098f * 30.0f, inertia = 2e-4f, friction = 0.03f, turn = 6.2831853f;
    Bench bench;
    bench.volts = 11.1f;
    twbal::TwoWheels<Bench> wheels(bench, believed);
    float angle = 0.0f, rate = 0.0f;
    for (int k = 0; k < 2500; ++k) {
        const float held = k < 500 ? turn : 0.0f;
        if (k % 5 == 0) {
            bench.left = static_cast<int32_t>(floorf(angle / turn * 660.0f));
            wheels.sense(twbal::WheelCommands{command, 0.0f}, TWBAL_DRIVE_TORQUE, k > 0 ? 0.01f : 0.0f);
        }
        wheels.drive(twbal::WheelCommands{command, 0.0f}, TWBAL_DRIVE_TORQUE, true);
        for (int part = 0; part < 20; ++part) {
            const float volts = bench.volts * bench.left_duty;
            const float torque = bench.left_duty == 0.0f ? 0.0f : constant / resistance * (volts - constant * rate);
            const float after = rate + 1e-4f / inertia * (torque - (rate > 0.0f ? friction : -friction));
            const bool sticks = fabsf(torque) <= friction && after * rate <= 0.0f;
            rate = held > 0.0f ? held : (sticks ? 0.0f : after);
            angle += 1e-4f * rate;
        }
    }
    return rate;
}

// A command of 0 drives no wheel, and one against the motion none with it, whatever counts, gear and dead duty say.
static void wheel_in_a_hand()
{
    const float counts[] = {220.0f, 330.0f, 660.0f, 1320.0f, -660.0f}, gears[] = {15.0f, 30.0f, 45.0f, 90.0f};
    const float dead_duties[] = {0.0f, 0.1f, 0.3f};
    for (float count : counts) {
        for (float gear : gears) {
            for (float dead : dead_duties) {
                const twbal::Build believed = {{7.0f, 0.0098f, gear}, dead, count, count, 0.5f, 0.01f, true, 0.0f, 24.0f};
                check(let_go(believed, 0.0f) == 0.0f, "a command of 0 drives no wheel");
                const float volts = 11.1f, turn = 6.2831853f, brakes[] = {-1e-6f, -0.1f, -0.5f, -2.0f};
                for (float brake : brakes) {
                    Bench bench;
                    bench.volts = volts;
                    twbal::TwoWheels<Bench> wheels(bench, believed);
                    wheels.sense(twbal::WheelCommands{0.0f, 0.0f}, TWBAL_DRIVE_TORQUE, 0.0f);
                    bench.left = bench.right = count > 0.0f ? 66 : -66; // it is seen to roll forward
                    wheels.sense(twbal::WheelCommands{0.0f, 0.0f}, TWBAL_DRIVE_TORQUE, 0.02f);
                    wheels.drive(twbal::WheelCommands{brake, 0.0f}, TWBAL_DRIVE_TORQUE, true);
                    const float asked = 0.5f * brake * 7.0f / (0.0098f * gear) / volts;
                    const float emf = 0.0098f * gear * 66.0f / fabsf(count) * turn / 0.02f / volts;
                    const float most = (emf < 1.0f ? emf : 1.0f) + asked; // of the bridge, whatever the dead duty
                    check(bench.left_duty <= (most > 0.0f ? most : 0.0f) + 1e-5f, "what brakes never drives on");
                }
            }
        }
    }
}

// The duty below which a motor does not turn is added to torques, in their direction, and not to voltages.
static void dead_duty()
{
    const twbal::Build plain = {{6.0f, 0.01f, 30.0f}, 0.0f, 660.0f, 660.0f, 0.5f, 0.01f, true, 0.0f, 24.0f};
    twbal::Build dead = plain;
    dead.dead_duty = 0.2f;
    Bench bench, same;
    twbal::TwoWheels<Bench> with(bench, dead), without(same, plain);
    with.drive(twbal::WheelCommands{0.06f, 0.0f}, TWBAL_DRIVE_TORQUE, true); // 0.6 V of 12 V a wheel at a standstill
    check(near(bench.left_duty, 0.2f + 0.8f * 0.05f, 1e-6f), "a torque turns a wheel that sticks");
    bench.left = same.left = 33; // it rolls forward at 5 turns/s: a back-EMF of 9.4 V
    const twbal::WheelCommands brake = {-0.06f, 0.0f};
    with.sense(brake, TWBAL_DRIVE_TORQUE, 0.01f);
    without.sense(brake, TWBAL_DRIVE_TORQUE, 0.01f);
    with.drive(brake, TWBAL_DRIVE_TORQUE, true);
    without.drive(brake, TWBAL_DRIVE_TORQUE, true);
    check(near(bench.left_duty, 0.8f * same.left_duty - 0.2f, 1e-5f), "in its direction, not in the motion's");
    with.drive(twbal::WheelCommands{12.0f, 0.0f}, TWBAL_DRIVE_VOLTAGE, true);
    check(near(bench.left_duty, 0.5f, 1e-6f), "a voltage is put out as it is");
    with.drive(twbal::WheelCommands{NAN, 0.0f}, TWBAL_DRIVE_TORQUE, true);
    check(bench.left_duty == 0.0f, "no number, no duty, also with a dead duty");
    bench.volts = NAN;
    with.drive(twbal::WheelCommands{0.4f, 0.0f}, TWBAL_DRIVE_TORQUE, true);
    check(bench.left_duty == 0.0f, "the same of the battery");
}

// A motor that is made for less than the battery's voltage gets no more than its own, whatever drives it.
static void motor_voltage()
{
    twbal::Build weak = {{6.0f, 0.01f, 30.0f}, 0.0f, 660.0f, 660.0f, 0.5f, 0.01f, true, 0.0f, 6.0f};
    const float most = 6.0f / 12.6f, dead_duties[] = {0.0f, 0.3f};
    for (float dead : dead_duties) {
        weak.dead_duty = dead;
        Bench bench;
        bench.volts = 12.6f;
        twbal::TwoWheels<Bench> wheels(bench, weak);
        wheels.drive(twbal::WheelCommands{4.0f, 0.0f}, TWBAL_DRIVE_TORQUE, true);
        check(near(bench.left_duty, most, 1e-6f), "a torque ends at the motor's voltage");
        wheels.drive(twbal::WheelCommands{-4.0f, 0.0f}, TWBAL_DRIVE_TORQUE, true);
        check(near(bench.left_duty, -most, 1e-6f), "backward, too");
        wheels.drive(twbal::WheelCommands{24.0f, 0.0f}, TWBAL_DRIVE_VOLTAGE, true);
        check(near(bench.left_duty, most, 1e-6f), "and a voltage");
        bench.left = bench.right = 66; // it rolls at 10 turns/s, by a push: a back-EMF of 18.8 V
        wheels.sense(twbal::WheelCommands{0.0f, 0.0f}, TWBAL_DRIVE_TORQUE, 0.01f);
        wheels.drive(twbal::WheelCommands{0.06f, 0.0f}, TWBAL_DRIVE_TORQUE, true);
        check(bench.left_duty <= most + 1e-6f, "and what the back-EMF asks for");
    }
}

template <class Message>
static void tell(FakeRobot& robot, const Message& message, uint32_t now_us)
{
    Kept line;
    twbal::write_frame(line, reinterpret_cast<const uint8_t*>(&message), sizeof message);
    robot.receive(line.bytes, line.size, now_us);
}

// The clock of 32 bits overflows in mid-rollout, and the watchdog is as patient as ever.
static void watchdog()
{
    const twbal::Identity me = fake_identity(TWBAL_CLOCK_REAL_TIME);
    const uint32_t starts[] = {1000u, 0xFFFFFFFFu - 50000u};
    for (uint32_t start : starts) {
        FakeBoard board;
        FakePolicy policy;
        FakeRobot robot(me, board, policy);
        tell(robot, twbal_hello{TWBAL_TYPE_HELLO, 1, 2}, start);
        tell(robot, twbal_arm{TWBAL_TYPE_ARM, 2, 0, TWBAL_DRIVE_TORQUE}, start);
        tell(robot, twbal_command{TWBAL_TYPE_COMMAND, 3, 5.0f, 0.0f}, start);
        uint32_t on_until = 0;
        for (uint32_t now = 0; now < 300000; now += 1000) {
            robot.run(start + now);
            on_until = robot.motors_may_be_on() ? now : on_until;
        }
        check(on_until == 100000, "the watchdog stops at 100 ms, neither before nor after");
        check(robot.state() == twbal::State::TRIPPED && robot.output().total == 0.0f, "and stays so");
    }
}

static void part_of_a_period()
{
    const twbal::Identity me = fake_identity(TWBAL_CLOCK_REAL_TIME);
    FakeBoard board;
    FakePolicy policy;
    FakeRobot robot(me, board, policy);
    const uint32_t armed = 0xFFFFF000u; // the clock overflows within the period
    tell(robot, twbal_hello{TWBAL_TYPE_HELLO, 1, 2}, armed);
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 2, 0, TWBAL_DRIVE_TORQUE}, armed);
    check(robot.since_tick_us(armed) == 0u && robot.since_tick_us(armed + 19999u) == 19999u, "part of a period");
    check(robot.since_tick_us(armed + 20000u) == 20000u && robot.since_tick_us(armed + 90000u) == 20000u, "all of it");
    robot.run(armed + 20000u);
    check(robot.since_tick_us(armed + 20007u) == 7u, "and of the next");
}

// A loop that is late looks late: rates are over the time that passed, and the next look comes after less of it.
static void late_looks()
{
    const twbal::Identity me = fake_identity(TWBAL_CLOCK_REAL_TIME);
    FakeBoard board;
    FakePolicy policy;
    FakeRobot robot(me, board, policy);
    const uint32_t armed = 0xFFFFF000u; // the clock overflows within the first period
    tell(robot, twbal_hello{TWBAL_TYPE_HELLO, 1, 2}, armed);
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 2, 0, TWBAL_DRIVE_ON_BOARD}, armed);
    check(board.elapsed == 0.0f, "no time has passed at arming");
    const uint32_t looks[] = {20000u, 65000u, 80000u};
    const float elapsed[] = {0.02f, 0.045f, 0.015f};
    for (int k = 0; k < 3; ++k) {
        robot.skip_missed(armed + looks[k]);
        robot.run(armed + looks[k]);
        check(board.looks == k + 2 && near(board.elapsed, elapsed[k], 1e-6f), "time since the look before");
    }
}

// An Arm that cannot be followed leaves a robot that has stopped itself as it is, in state, clock and telemetry.
static void refused_arming()
{
    const twbal::Identity me = fake_identity(TWBAL_CLOCK_REAL_TIME);
    FakeBoard board;
    FakePolicy policy;
    FakeRobot robot(me, board, policy);
    const uint32_t armed = 3000000000u;
    tell(robot, twbal_hello{TWBAL_TYPE_HELLO, 1, 2}, armed);
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 2, 0, TWBAL_DRIVE_TORQUE}, armed);
    board.seen.tilt = NAN;
    board.arms = false;
    robot.run(armed + 20000u);
    check(robot.state() == twbal::State::TRIPPED, "a sensor that died stops it");
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 3, 1, TWBAL_DRIVE_TORQUE}, armed + 30000u);
    check(robot.state() == twbal::State::TRIPPED, "and stays");
    const int looks = board.looks;
    robot.run(armed + 40000u);
    check(board.looks == looks + 1, "one telemetry a period, as before");
    board.seen.tilt = 0.0f;
    board.arms = true;
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 4, 1, TWBAL_DRIVE_TORQUE}, armed + 50000u);
    board.arms = false;
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 5, 2, TWBAL_DRIVE_TORQUE}, armed + 55000u);
    check(robot.state() == twbal::State::ARMED, "an armed one stays armed");
}

static void on_board()
{
    const twbal::Identity me = fake_identity(TWBAL_CLOCK_REAL_TIME);
    FakeBoard board;
    FakePolicy policy;
    FakeRobot robot(me, board, policy);
    board.seen.tilt = 0.25f;
    tell(robot, twbal_hello{TWBAL_TYPE_HELLO, 1, 2}, 0);
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 2, 0, TWBAL_DRIVE_ON_BOARD}, 0);
    check(robot.output().total == 0.5f, "the policy drives from the first observation on");
    tell(robot, twbal_command{TWBAL_TYPE_COMMAND, 3, 9.0f, 0.0f}, 0);
    check(robot.output().total == 0.5f, "a Command is refused");
    tell(robot, twbal_follow{TWBAL_TYPE_FOLLOW, 4, 1.0f, 0.0f, NAN, 0.0f, 0}, 0);
    uint32_t on_until = 0;
    for (uint32_t now = 0; now < 12000000; now += 5000) {
        robot.run(now);
        check(now != 1000000 || robot.output().total == 1.5f, "it balances on where the host is silent");
        on_until = robot.motors_may_be_on() ? now : on_until;
    }
    check(on_until == 10000000, "and stops after 10 s");
    check(policy.calls == 501, "one call a control period");
    board.seen.tilt = NAN;
    tell(robot, twbal_arm{TWBAL_TYPE_ARM, 5, 0, TWBAL_DRIVE_ON_BOARD}, 20000000);
    check(!robot.motors_may_be_on(), "no number, no motors");
}

int main()
{
    frames();
    limits();
    motors();
    attitude();
    encoders();
    heading();
    body();
    after_a_failure();
    unread();
    wheel_in_a_hand();
    dead_duty();
    motor_voltage();
    watchdog();
    part_of_a_period();
    late_looks();
    refused_arming();
    on_board();
    printf(failed ? "%d checks failed\n" : "units: all checks hold\n", failed);
    return failed != 0;
}
