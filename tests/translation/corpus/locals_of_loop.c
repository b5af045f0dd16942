// A loop() that needs more than the registers: an array, a structure that is handed on, and floats
// that are put aside over calls. Most passes make the same of it again.
#include <kilolib.h>
#include <string.h>

typedef struct {
    uint8_t bytes[6];
} report_t;

static uint32_t next_report;
static report_t last;
static volatile float wide = 1.5f;

static void report(const report_t *made) {
    if (kilo_ticks < next_report) return;
    next_report = kilo_ticks + 40;
    last = *made;
    set_color(RGB(last.bytes[0] & 3, last.bytes[2] & 3, last.bytes[4] & 3));
}

static float seconds(void) { return (float)kilo_ticks / TICKS_PER_SEC; }

static void setup(void) {}

static void loop(void) {
    volatile uint8_t shares[8];
    const float now = seconds();
    for (uint8_t i = 0; i < sizeof shares; i++) shares[i] = (uint8_t)(now * wide * i);
    report_t made;
    for (uint8_t i = 0; i < sizeof made.bytes; i++) made.bytes[i] = shares[i] ^ shares[i + 2];
    report(&made);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
