// Sends all the time; prints its ticks every ten seconds.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static message_t out;

static message_t *send(void) { return &out; }

static void setup(void) { out.crc = message_crc(&out); }

static void loop(void) {
    delay(10000);
    printf("%lu", (unsigned long)kilo_ticks);
}

int main(void) {
    kilo_message_tx = send;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
