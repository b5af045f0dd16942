// Calls through NULL, one way for each uid; at each start it prints what was left from before.
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stddef.h>

static void (*volatile function)(void);
static uint8_t runs;

static void setup(void) {
    printf("begins, %d", runs++);
    if (kilo_uid == 2) kilo_message_tx = NULL;
    if (kilo_uid == 3) kilo_message_rx = NULL;
}

static void loop(void) {
    if (kilo_uid == 1 && kilo_ticks > 100) function();
}

int main(void) {
    kilo_init();
    if (kilo_uid == 4) function();
    kilo_start(setup, loop);
    return 0;
}
