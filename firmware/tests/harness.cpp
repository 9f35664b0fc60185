// The robot's side of the link as a library, for tests in Python.
#include <new>

#include "fake_board.h"

namespace {

FakeBoard board;
FakePolicy policy;
twbal::Identity identity = fake_identity(TWBAL_CLOCK_REAL_TIME);
alignas(FakeRobot) unsigned char place[sizeof(FakeRobot)];
FakeRobot* robot = nullptr;

} // namespace

extern "C" {

void robot_start(int clock)
{
    identity = fake_identity(static_cast<uint8_t>(clock));
    board = FakeBoard();
    policy = FakePolicy();
    robot = new (place) FakeRobot(identity, board, policy);
}
void robot_receive(const uint8_t* bytes, int count, uint32_t now_us)
{
    robot->receive(bytes, static_cast<size_t>(count), now_us);
}
void robot_run(uint32_t now_us) { robot->run(now_us); }
void robot_port_closed() { robot->port_closed(); }
void robot_sees(float tilt, float rate)
{
    board.seen.tilt = tilt;
    board.seen.tilt_rate = rate;
}
int robot_state() { return static_cast<int>(robot->state()); }
int robot_motors_may_be_on() { return robot->motors_may_be_on(); }
float robot_total() { return robot->output().total; }
float robot_difference() { return robot->output().difference; }
int robot_sent(uint8_t* bytes)
{
    const int count = static_cast<int>(board.size);
    memcpy(bytes, board.sent, board.size);
    board.size = 0;
    return count;
}
int transition_next(int state, int event)
{
    return static_cast<int>(twbal::transition(static_cast<twbal::State>(state), static_cast<twbal::Event>(event)).next);
}
int transition_reply(int state, int event)
{
    return static_cast<int>(
        twbal::transition(static_cast<twbal::State>(state), static_cast<twbal::Event>(event)).reply);
}
}
