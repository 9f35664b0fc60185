// The Balboa's board file on this computer, with USB that holds as much as Arduino's: two packets of 64 bytes, of which
// the host fetches one each millisecond. Prints what the robot sends, as hexadecimal digits; how often a write had to wait
// for the host; and the largest share of the battery's voltage that a motor gets, of 400.
//
//     balboa_line <ms that it lasts> <1: the host reads, 0: it does not> <frames of the host, 5 ms apart, as hexadecimal>
//                 [<register of the IMU> <writes to it that are lost> [<specific force along its x> <along its z>]]
#include <stdio.h>
#include <stdlib.h>

#include "../boards/balboa/main.cpp"
#include "fake_imu.h"

namespace {

const size_t PACKET = 64;

uint64_t now_us = 0;
const char* said = ""; // by the host, and not yet read by the robot
size_t filled = 0, ready = 0; // bytes in the packet that is being filled, and in the one that waits for the host
unsigned waited = 0;          // writes that could not end before the host had fetched a packet

// A packet that is full, or as old as a millisecond, is for the host, if the one before was fetched.
void hand_over()
{
    if (ready == 0) {
        ready = filled;
        filled = 0;
    }
}

} // namespace

unsigned long micros() { return static_cast<unsigned long>(now_us); }

int SerialStub::available() { return static_cast<int>(strcspn(said, " ") / 2); }
int SerialStub::read()
{
    const char digits[3] = {said[0], said[1], 0};
    said += 2;
    return static_cast<int>(strtol(digits, nullptr, 16));
}
int SerialStub::availableForWrite() { return static_cast<int>(filled == PACKET ? 0 : PACKET - filled); }
size_t SerialStub::write(const uint8_t* bytes, size_t size)
{
    for (size_t k = 0; k < size; ++k) {
        if (filled == PACKET) {
            ready = 0; // at last
            hand_over();
        }
        printf("%02x", static_cast<unsigned>(bytes[k]));
        if (++filled == PACKET) {
            waited += ready > 0; // Arduino ends a full packet by the next one, for which there is no room
            hand_over();
        }
    }
    return size;
}
bool SerialStub::dtr() { return true; }
void SerialStub::begin(unsigned long) {}
SerialStub Serial;

// As Pololu's library: beyond its most, which is 300 until turbo is allowed, a speed is cut.
namespace {
int most_speed = 300, most_given = 0;
}
void Balboa32U4Motors::allowTurbo(bool turbo) { most_speed = turbo ? 400 : 300; }
void Balboa32U4Motors::flipLeftMotor(bool) {}
void Balboa32U4Motors::flipRightMotor(bool) {}
void Balboa32U4Motors::setSpeeds(int16_t left, int16_t right)
{
    const int both[] = {abs(left), abs(right)};
    for (int asked : both) {
        const int given = asked > most_speed ? most_speed : asked;
        most_given = given > most_given ? given : most_given;
    }
}
int16_t Balboa32U4Encoders::getCountsAndResetLeft() { return 0; }
int16_t Balboa32U4Encoders::getCountsAndResetRight() { return 0; }
uint16_t readBatteryMillivolts() { return 7200; }
void wdt_enable(int) {}
void wdt_reset() {}

int main(int count, char** words)
{
    if (count != 4 && count != 6 && count != 8) {
        return 2;
    }
    if (count >= 6) {
        fake_imu.loses = static_cast<uint8_t>(atoi(words[4]));
        fake_imu.lost = atol(words[5]);
    }
    if (count == 8) {
        fake_imu.measured[3] = static_cast<uint16_t>(atoi(words[6]));
        fake_imu.measured[5] = static_cast<uint16_t>(atoi(words[7]));
    }
    const int lasts = atoi(words[1]);
    const bool host_reads = atoi(words[2]) != 0;
    setup();
    for (int ms = 0; ms < lasts; ++ms) {
        if (ms >= 20 && ms % 5 == 0) { // the first samples are taken by then
            said = ms == 20 ? words[3] : (*said == ' ' ? said + 1 : said);
        }
        for (int turn = 0; turn < 5; ++turn) {
            loop();
            now_us += 200;
        }
        if (host_reads) {
            ready = 0;
        }
        hand_over();
    }
    printf("\n%u\n%d\n", waited, most_given);
    return 0;
}
