// The ESP32's board file on this computer, once the board has started: prints how long a loop may hang before the board
// is reset [ms], 0 where it may hang for ever; and the first of 100 samples of the IMU that is taken, 0 where none is.
//
//     esp32_start [<register of the IMU> <writes to it that are lost>]
#include <stdio.h>
#include <stdlib.h>

#include "../boards/esp32/main.cpp"
#include "fake_imu.h"

namespace {

uint32_t patience_ms = 5000; // Arduino's own
bool resets = true, is_watched = false;

} // namespace

unsigned long micros() { return 0; }
void pinMode(int, int) {}
void digitalWrite(int, int) {}
int digitalRead(int) { return 0; }
int digitalPinToInterrupt(int pin) { return pin; }
void attachInterrupt(int, void (*)(), int) {}
uint32_t analogReadMilliVolts(int) { return 0; }
uint32_t ledcSetup(uint8_t, uint32_t, uint8_t) { return 0; }
void ledcAttachPin(uint8_t, uint8_t) {}
bool ledcAttach(uint8_t, uint32_t, uint8_t) { return true; }
void ledcWrite(uint8_t, uint32_t) {}
void enableLoopWDT() { is_watched = true; }
#if ESP_ARDUINO_VERSION_MAJOR >= 3
int esp_task_wdt_reconfigure(const esp_task_wdt_config_t* config)
{
    patience_ms = config->timeout_ms;
    resets = config->trigger_panic;
    return 0;
}
#else
int esp_task_wdt_init(uint32_t seconds, bool panic)
{
    patience_ms = 1000 * seconds;
    resets = panic;
    return 0;
}
#endif

void SerialStub::setRxBufferSize(size_t) {}
void SerialStub::begin(unsigned long) {}
int SerialStub::available() { return 0; }
int SerialStub::read() { return 0; }
size_t SerialStub::write(const uint8_t*, size_t size) { return size; }
SerialStub Serial;

int main(int count, char** words)
{
    if (count == 3) {
        fake_imu.loses = static_cast<uint8_t>(atoi(words[1]));
        fake_imu.lost = atol(words[2]);
    }
    setup();
    int sample = 1;
    for (twbal::ImuSample seen; sample <= 100 && !hardware.read_imu(seen);) {
        ++sample;
    }
    loop();
    printf("%u %d\n", resets && is_watched ? patience_ms : 0u, sample <= 100 ? sample : 0);
    return 0;
}
