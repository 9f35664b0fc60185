// The firmware as a program: its line is a pseudo-terminal, its body a process behind stdin and stdout. It prints
// "port <path>" to stderr, and ends when its body does, when no host has come for a while, or on SIGTERM.
//
//     robot_posix <name> <period_us> <torque_limit> <difference_limit> <tilt_limit> <watchdog_us> <clock> <sensors>
//                 <idle_s>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>

#include "physics.h"
#include "twbal/robot.h"

#ifdef TWBAL_WITH_POLICY
#include "twbal/policy_on_board.h"
#else
#define TWBAL_POLICY_ID 0u
#endif

namespace {

const int32_t LOOK_ROUND_US = 500000;
const int32_t MOVE_EVERY_US = 1000; // the body moves so often within a control period
const useconds_t ABSENT_US = 20000; // how often to look whether a host has opened the port

uint64_t monotonic_us()
{
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<uint64_t>(now.tv_sec) * 1000000u + static_cast<uint64_t>(now.tv_nsec) / 1000u;
}

// The robot's end of a pseudo-terminal, or -1.
int open_port()
{
    const int port = posix_openpt(O_RDWR | O_NOCTTY);
    if (port < 0 || grantpt(port) != 0 || unlockpt(port) != 0) {
        return -1;
    }
    const char* path = ptsname(port);
    const int host = path ? open(path, O_RDWR | O_NOCTTY) : -1;
    termios raw;
    if (host < 0 || tcgetattr(host, &raw) != 0) {
        return -1;
    }
    cfmakeraw(&raw);
    tcsetattr(host, TCSANOW, &raw); // it stays so for the hosts that open it
    close(host);                    // held open, it would hide that a host has gone
    fcntl(port, F_SETFL, O_NONBLOCK);
    fprintf(stderr, "port %s\n", path);
    return port;
}

struct Arguments {
    twbal::Identity identity;
    uint64_t idle_us;
};

bool read_arguments(int count, char** words, Arguments& made)
{
    if (count != 10) {
        return false;
    }
    twbal::Identity& me = made.identity;
    me.name = words[1];
    me.control_period_us = static_cast<uint32_t>(strtoul(words[2], nullptr, 10));
    me.torque_limit = strtof(words[3], nullptr);
    me.difference_limit = strtof(words[4], nullptr);
    me.voltage_limit = NAN;
    me.tilt_limit = strtof(words[5], nullptr);
    me.watchdogs.host_us = static_cast<uint32_t>(strtoul(words[6], nullptr, 10));
    me.watchdogs.on_board_us = TWBAL_ON_BOARD_WATCHDOG_US;
    me.clock = static_cast<uint8_t>(strtoul(words[7], nullptr, 10));
    me.sensors = static_cast<uint16_t>(strtoul(words[8], nullptr, 10));
    me.policy = TWBAL_POLICY_ID;
    me.firmware = 0;
    made.idle_us = static_cast<uint64_t>(1e6 * strtod(words[9], nullptr));
    return me.control_period_us > 0 && me.torque_limit > 0.0f && me.tilt_limit > 0.0f && me.watchdogs.host_us > 0;
}

// How long nothing has to be done: until the control period is over, or the body moves next.
template <class Robot>
timespec wait_time(const Robot& robot, uint32_t now_us)
{
    int32_t left_us = LOOK_ROUND_US;
    if (robot.is_timed()) {
        left_us = static_cast<int32_t>(robot.next_tick_us() - now_us);
        left_us = left_us < 0 ? 0 : left_us < MOVE_EVERY_US ? left_us : MOVE_EVERY_US;
    }
    return timespec{0, 1000 * left_us};
}

// The body moves by what the motors have got until now.
template <class Robot>
void move(const Robot& robot, twbal::PhysicsPipe& body, uint32_t now_us)
{
    if (robot.is_timed()) {
        body.pass(robot.output(), robot.since_tick_us(now_us));
    }
}

template <class Robot>
int serve(Robot& robot, twbal::PhysicsPipe& body, int port, uint64_t idle_us)
{
    uint64_t attended = monotonic_us();
    uint8_t bytes[512];
    while (!body.is_gone()) {
        pollfd lines[2] = {{port, POLLIN, 0}, {STDIN_FILENO, 0, 0}};
        const timespec wait = wait_time(robot, static_cast<uint32_t>(monotonic_us()));
        ppoll(lines, 2, &wait, nullptr);
        if (lines[1].revents & (POLLHUP | POLLERR)) {
            return 0; // its body has ended
        }
        const ssize_t got = read(port, bytes, sizeof bytes);
        const uint64_t now = monotonic_us();
        if (got < 0 && errno == EIO) { // no host has the port open
            robot.port_closed();
            if (now - attended > idle_us) {
                return 0;
            }
            usleep(ABSENT_US);
            continue;
        }
        attended = now;
        move(robot, body, static_cast<uint32_t>(now));
        if (got > 0) {
            robot.receive(bytes, static_cast<size_t>(got), static_cast<uint32_t>(now));
        }
        robot.run(static_cast<uint32_t>(now));
        body.flush();
    }
    return 1;
}

} // namespace

int main(int count, char** words)
{
    Arguments made;
    if (!read_arguments(count, words, made)) {
        fputs("robot_posix is the firmware without a board. It needs physics behind its stdin and stdout, by which\n"
              "    twbal virtual-robot firmware=firmware/build/robot_posix clock=real_time\n"
              "starts it, and prints its port. Its arguments, in this order, with examples:\n"
              "    name            esp32\n"
              "    period          10000     us\n"
              "    torque limit    0.98      N m, sum of both wheels\n"
              "    difference      0.5       N m; 0: it does not turn\n"
              "    tilt limit      1.0       rad\n"
              "    watchdog        100000    us\n"
              "    clock           0         0: lockstep, 1: real time\n"
              "    sensors         7         bits of docs/protocol.md\n"
              "    idle time       600       s without a host, after which it ends\n",
              stderr);
        return 2;
    }
#ifdef TWBAL_WITH_POLICY
    if (!twbal::policy_is_of_period(static_cast<float>(made.identity.control_period_us))) {
        fprintf(stderr, "the policy on board is of another control period than %u us\n", made.identity.control_period_us);
        return 1;
    }
#endif
    const int port = open_port();
    if (port < 0) {
        fprintf(stderr, "robot_posix cannot make a pseudo-terminal\n");
        return 1;
    }
    twbal::PhysicsPipe body(STDOUT_FILENO, STDIN_FILENO, port);
#ifdef TWBAL_WITH_POLICY
    twbal::PolicyOnBoard policy(twbal::HeadingLoop{0.0f, 1.0f, 1.0f, 0.0f}); // this body does not turn
#else
    twbal::NoPolicy policy;
#endif
    twbal::Robot<twbal::PhysicsPipe, decltype(policy)> robot(made.identity, body, policy);
    return serve(robot, body, port, made.idle_us);
}
