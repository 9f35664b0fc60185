// The ESP32's board file on this computer: prints how long a loop may hang before the board is reset [ms], 0 where it may
// hang for ever, once the board has started.
#include <stdio.h>

#include "../boards/esp32/main.cpp"

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

void WireStub::begin(int, int) {}
void WireStub::setClock(uint32_t) {}
void WireStub::setTimeOut(uint16_t) {}
void WireStub::beginTransmission(uint8_t) {}
void WireStub::write(uint8_t) {}
uint8_t WireStub::endTransmission(bool) { return 0; }
uint8_t WireStub::requestFrom(uint8_t, uint8_t count) { return count; }
int WireStub::read() { return 0; }
WireStub Wire;

int main()
{
    setup();
    loop();
    printf("%u\n", resets && is_watched ? patience_ms : 0u);
    return 0;
}
