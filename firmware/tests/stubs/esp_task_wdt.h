#ifndef ESP_TASK_WDT_STUB_H
#define ESP_TASK_WDT_STUB_H

#include <stdint.h>

#if ESP_ARDUINO_VERSION_MAJOR >= 3
struct esp_task_wdt_config_t {
    uint32_t timeout_ms;
    uint32_t idle_core_mask;
    bool trigger_panic;
};
int esp_task_wdt_reconfigure(const esp_task_wdt_config_t* config);
#else
int esp_task_wdt_init(uint32_t seconds, bool panic);
#endif

#endif
