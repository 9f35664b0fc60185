// The robot's side of the link: bytes and the time in, bytes and wheel commands out. No port, no clock, no motor in sight.
//
// `Board` has
//     bool arm(uint32_t trial);                 reset angles and filters; false: the robot cannot be armed now
//     Sensed sense(WheelCommands, uint8_t drive, float elapsed); what the sensors say now, after a period with these
//                                               commands, `elapsed` [s] after they were asked last; 0 after arming
//     bool pose(twbal_pose_report&);            true pose, where something knows it
//     void write(const uint8_t*, size_t);       to the host
// and `Policy` has
//     void reset();  WheelCommands step(const Sensed&, float period, const twbal_follow&);
#ifndef TWBAL_ROBOT_H
#define TWBAL_ROBOT_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "twbal/frame.h"
#include "twbal/inbox.h"
#include "twbal/protocol_messages.h"
#include "twbal/quantities.h"
#include "twbal/safety.h"

namespace twbal {

struct Identity {
    const char* name;
    uint32_t control_period_us;
    float torque_limit;     // of the sum [N m]
    float difference_limit; // [N m]; 0: it does not turn
    float voltage_limit;    // of a motor [V]; NaN: it takes no voltages
    float tilt_limit;       // at which it stops itself [rad]
    uint8_t clock;
    uint16_t sensors;
    uint32_t policy;   // of the policy on board; 0: none
    uint32_t firmware; // of this build; 0: unknown
    Watchdogs watchdogs;
};

// For a board without a policy.
struct NoPolicy {
    void reset() {}
    WheelCommands step(const Sensed&, float, const twbal_follow&) { return WheelCommands{0.0f, 0.0f}; }
};

template <class Board, class Policy = NoPolicy>
class Robot {
public:
    Robot(const Identity& me, Board& board, Policy& policy)
        : me_(me), board_(board), policy_(policy), safety_(me.tilt_limit, me.watchdogs)
    {
        stand();
    }

    // What the motors get now, in the unit of the drive; nothing where they must be off.
    WheelCommands output() const { return safety_.motors_may_be_on() ? commands_ : WheelCommands{0.0f, 0.0f}; }
    bool motors_may_be_on() const { return safety_.motors_may_be_on(); }
    uint8_t drive() const { return drive_; }
    State state() const { return safety_.state(); }

    // Whether a control period runs, and when it ends.
    bool is_timed() const { return !standing() && me_.clock == TWBAL_CLOCK_REAL_TIME; }
    uint32_t next_tick_us() const { return tick_us_ + me_.control_period_us; }

    // Part of that period which is over [us]: all of it from its end on.
    uint32_t since_tick_us(uint32_t now_us) const
    {
        return reached(next_tick_us(), now_us) ? me_.control_period_us : now_us - tick_us_;
    }

    // Bytes of the host. They may have waited while the loop was held: what comes after the watchdog's time is too late.
    void receive(const uint8_t* data, size_t size, uint32_t now_us)
    {
        if (is_timed()) {
            watch(now_us);
        }
        for (size_t k = 0; k < size; ++k) {
            if (reader_.feed(data[k])) {
                take(now_us);
            }
        }
    }

    // To be called at least every 5 ms: the watchdog, and the ends of control periods.
    void run(uint32_t now_us)
    {
        while (is_timed() && reached(next_tick_us(), now_us)) {
            watch(next_tick_us());
            tick_us_ = next_tick_us();
            finish_period(now_us);
        }
        if (is_timed()) {
            watch(now_us);
        }
    }

    // A board that samples when it is asked skips periods that it missed, instead of measuring one instant twice.
    void skip_missed(uint32_t now_us)
    {
        while (is_timed() && reached(next_tick_us() + me_.control_period_us, now_us)) {
            tick_us_ += me_.control_period_us;
            ++period_;
            ++late_;
        }
    }

    void port_closed()
    {
        safety_.on(Event::PORT_CLOSED);
        stand();
    }

private:
    static bool reached(uint32_t moment, uint32_t now) { return static_cast<int32_t>(now - moment) >= 0; }
    bool standing() const { return safety_.state() == State::STRANGE || safety_.state() == State::OFF; }
    bool in_real_time() const { return me_.clock == TWBAL_CLOCK_REAL_TIME; }

    void watch(uint32_t now_us)
    {
        if (!safety_.motors_may_be_on()) {
            return;
        }
        const bool on_board = drive_ == TWBAL_DRIVE_ON_BOARD;
        if (on_board && safety_.silence_us(now_us) > me_.watchdogs.host_us) {
            host_is_silent_ = true;
            follow_.speed = follow_.yaw_rate = 0.0f; // at rest where the reference is
        }
        safety_.check_watchdog(now_us, on_board);
    }

    void take(uint32_t now_us)
    {
        const Heard heard = heard_in(reader_.payload(), reader_.size());
        if (heard == Heard::NOTHING) {
            reader_.drop();
            return;
        }
        const uint16_t seq = message_in<twbal_stop>(reader_.payload()).seq;
        if (heard == Heard::HELLO) {
            greet(seq);
            return;
        }
        if (safety_.state() == State::STRANGE) {
            fault(seq, "no handshake of this version yet; begin with Hello");
            return;
        }
        const uint16_t ahead = static_cast<uint16_t>(seq - taken_);
        if (ahead == 0) { // a repetition; telemetry that streams answers it
            if (!is_timed()) {
                repeat();
            }
            return;
        }
        if (ahead >= 0x8000u) {
            reader_.drop();
            return;
        }
        taken_ = seq;
        fault_ = nullptr;
        act(heard, now_us);
    }

    void greet(uint16_t seq)
    {
        const bool is_ours = message_in<twbal_hello>(reader_.payload()).version == TWBAL_PROTOCOL_VERSION;
        taken_ = seq;
        fault_ = nullptr;
        last_reply_ = safety_.on(is_ours ? Event::HELLO : Event::HELLO_OTHER);
        stand();
        repeat();
    }

    void act(Heard heard, uint32_t now_us)
    {
        Event event = Event::NOT_A_HOSTS;
        switch (heard) {
        case Heard::ARM:
            arm(message_in<twbal_arm>(reader_.payload()), now_us);
            return;
        case Heard::COMMAND:
            event = command(message_in<twbal_command>(reader_.payload()), now_us);
            break;
        case Heard::FOLLOW:
            event = follow(message_in<twbal_follow>(reader_.payload()), now_us);
            break;
        case Heard::STOP:
            event = Event::STOP;
            break;
        default:
            fault_ = "this is a robot's word, not a host's";
        }
        last_reply_ = safety_.on(event);
        if (event == Event::STOP) {
            stand();
        }
        if (last_reply_ == Reply::STREAM && !in_real_time()) {
            tick_us_ += me_.control_period_us;
            finish_period(now_us);
        } else if (last_reply_ != Reply::STREAM) {
            repeat();
        }
    }

    void arm(const twbal_arm& order, uint32_t now_us)
    {
        if (order.drive == TWBAL_DRIVE_ON_BOARD && me_.policy == 0) {
            fault_ = "there is no policy on board";
        } else if (order.drive == TWBAL_DRIVE_VOLTAGE && !(me_.voltage_limit > 0.0f)) {
            fault_ = "the motors take no voltages";
        } else if (!board_.arm(order.trial)) {
            fault_ = "the sensors do not answer";
        } else {
            stand();
        }
        last_reply_ = safety_.on(fault_ ? Event::ARM_REFUSED : Event::ARM);
        if (fault_) {
            repeat();
            return;
        }
        drive_ = order.drive;
        tick_us_ = seen_tick_us_ = in_real_time() ? now_us : 0;
        seen_us_ = tick_us_;
        told(now_us);
        policy_.reset();
        follow_ = twbal_follow{TWBAL_TYPE_FOLLOW, 0, 0.0f, 0.0f, NAN, 0.0f, 0};
        look(now_us);
        report();
    }

    Event command(const twbal_command& order, uint32_t now_us)
    {
        const WheelCommands asked = {order.total, order.difference};
        if (!isfinite(asked.total) || !isfinite(asked.difference)) {
            fault_ = "the command is not a finite number";
        } else if (standing()) {
            fault_ = "the motors are off; begin with Arm";
        } else if (drive_ == TWBAL_DRIVE_ON_BOARD) {
            fault_ = "the policy on board drives; send Follow";
        } else {
            if (safety_.motors_may_be_on()) {
                commands_ = limits().cut(asked);
                is_limited_ = !limits().allow(asked);
                told(now_us);
            }
            return Event::DRIVE;
        }
        return Event::DRIVE_REFUSED;
    }

    Event follow(const twbal_follow& order, uint32_t now_us)
    {
        const bool is_finite = isfinite(order.position) && isfinite(order.speed) && isfinite(order.yaw_rate);
        if (!is_finite || isinf(order.heading)) {
            fault_ = "the reference is not a finite number";
        } else if (standing()) {
            fault_ = "the motors are off; begin with Arm";
        } else if (drive_ != TWBAL_DRIVE_ON_BOARD) {
            fault_ = "the host drives; send Command";
        } else {
            if (safety_.motors_may_be_on()) {
                follow_ = order;
                told(now_us);
                if (!in_real_time()) {
                    decide(); // in lockstep the period begins with the reference
                }
            }
            return Event::DRIVE;
        }
        return Event::DRIVE_REFUSED;
    }

    void told(uint32_t now_us)
    {
        command_us_ = in_real_time() ? now_us : tick_us_;
        safety_.heard(command_us_);
        is_fresh_ = true;
        host_is_silent_ = false;
    }

    WheelLimits limits() const
    {
        if (drive_ == TWBAL_DRIVE_VOLTAGE) {
            const float most = 2.0f * me_.voltage_limit;
            return WheelLimits{most, me_.difference_limit > 0.0f ? most : 0.0f};
        }
        return WheelLimits{me_.torque_limit, me_.difference_limit};
    }

    // The period that ends now: what it did, what is seen, and what the next one gets.
    void finish_period(uint32_t now_us)
    {
        applied_ = output();
        ++period_;
        if (!is_fresh_ && in_real_time()) {
            ++late_;
        }
        is_fresh_ = false;
        look(now_us);
        report();
    }

    void look(uint32_t now_us)
    {
        const uint32_t at = in_real_time() ? now_us : tick_us_; // a late loop looks late
        seen_ = board_.sense(applied_, drive_, 1e-6f * static_cast<float>(at - seen_us_));
        since_ = 1e-6f * static_cast<float>(tick_us_ - seen_tick_us_); // more than a period, where some were missed
        seen_us_ = at;
        seen_tick_us_ = tick_us_;
        if (!safety_.motors_may_be_on()) {
            return;
        }
        safety_.check_sensors(seen_);
        is_decided_ = false;
        if (drive_ == TWBAL_DRIVE_ON_BOARD && in_real_time()) {
            decide();
        }
    }

    void decide()
    {
        if (!safety_.motors_may_be_on() || is_decided_) {
            return;
        }
        is_decided_ = true;
        const WheelCommands asked = policy_.step(seen_, since_, follow_);
        if (!isfinite(asked.total) || !isfinite(asked.difference)) {
            safety_.trip(TWBAL_STATUS_SENSOR_STOPPED);
            return;
        }
        commands_ = limits().cut(asked);
        is_limited_ = !limits().allow(asked);
    }

    // Motors off, nothing measured; what is armed is so no more.
    void stand()
    {
        commands_ = applied_ = WheelCommands{0.0f, 0.0f};
        drive_ = TWBAL_DRIVE_TORQUE;
        period_ = late_ = 0;
        tick_us_ = command_us_ = 0;
        is_fresh_ = is_limited_ = host_is_silent_ = is_decided_ = false;
        seen_ = Sensed();
        seen_.tilt = seen_.tilt_rate = seen_.wheel_angle = seen_.wheel_rate = 0.0f;
        if (safety_.motors_may_be_on()) {
            safety_.on(Event::STOP);
        }
    }

    // The answer to the last message, again.
    void repeat()
    {
        switch (last_reply_) {
        case Reply::WELCOME:
            welcome();
            break;
        case Reply::FAULT:
            fault(taken_, fault_);
            break;
        case Reply::TELEMETRY:
        case Reply::STREAM:
            report();
            break;
        case Reply::NONE:
            break;
        }
    }

    void welcome()
    {
        uint8_t bytes[sizeof(twbal_welcome) + TWBAL_MAX_TEXT];
        const twbal_welcome said = {TWBAL_TYPE_WELCOME, taken_, TWBAL_PROTOCOL_VERSION, me_.control_period_us,
            me_.torque_limit, me_.clock, me_.difference_limit, me_.voltage_limit, me_.sensors, me_.policy, me_.firmware};
        memcpy(bytes, &said, sizeof said);
        write_frame(board_, bytes, with_text(bytes, sizeof said, me_.name));
    }

    void fault(uint16_t seq, const char* why)
    {
        uint8_t bytes[sizeof(twbal_fault) + TWBAL_MAX_TEXT];
        const twbal_fault said = {TWBAL_TYPE_FAULT, seq};
        memcpy(bytes, &said, sizeof said);
        write_frame(board_, bytes, with_text(bytes, sizeof said, why));
    }

    static size_t with_text(uint8_t* bytes, size_t at, const char* text)
    {
        size_t size = strlen(text);
        size = size < TWBAL_MAX_TEXT ? size : TWBAL_MAX_TEXT;
        memcpy(bytes + at, text, size);
        return at + size;
    }

    void report()
    {
        twbal_pose_report pose = {TWBAL_TYPE_POSE_REPORT, taken_, period_, 0.0f, 0.0f, 0.0f, 0.0f};
        if (!standing() && board_.pose(pose)) {
            write_frame(board_, reinterpret_cast<const uint8_t*>(&pose), sizeof pose);
        }
        const twbal_telemetry said = {TWBAL_TYPE_TELEMETRY, taken_, period_, tick_us_, status(), seen_.tilt,
            seen_.tilt_rate, seen_.acceleration, seen_.wheel_angle, seen_.wheel_rate, seen_.wheel_difference,
            seen_.difference_rate, seen_.yaw_rate, seen_.heading, seen_.battery, applied_.total, applied_.difference,
            command_us_, late_, reader_.dropped()};
        write_frame(board_, reinterpret_cast<const uint8_t*>(&said), sizeof said);
    }

    uint8_t status() const
    {
        uint8_t bits = safety_.status();
        if (safety_.motors_may_be_on()) {
            bits = static_cast<uint8_t>(bits | (is_limited_ ? TWBAL_STATUS_LIMITED : 0u)
                | (drive_ == TWBAL_DRIVE_ON_BOARD ? TWBAL_STATUS_ON_BOARD : 0u)
                | (host_is_silent_ ? TWBAL_STATUS_HOST_SILENT : 0u));
        }
        return bits;
    }

    const Identity& me_;
    Board& board_;
    Policy& policy_;
    Safety safety_;
    FrameReader reader_;
    uint16_t taken_ = 0; // number of the host's message that was acted on last
    Reply last_reply_ = Reply::NONE;
    const char* fault_ = nullptr; // why that message could not be followed
    WheelCommands commands_, applied_;
    twbal_follow follow_ = {};
    Sensed seen_;
    float since_ = 0.0f; // from the observation before to this one [s]
    uint8_t drive_ = 0;
    uint16_t period_ = 0, late_ = 0;
    uint32_t tick_us_ = 0; // when the last control period ended, on the robot's clock
    uint32_t command_us_ = 0;
    uint32_t seen_us_ = 0, seen_tick_us_ = 0; // when the sensors were asked last, and the period that had ended then
    bool is_fresh_ = false, is_limited_ = false, host_is_silent_ = false, is_decided_ = false;
};

} // namespace twbal

#endif
