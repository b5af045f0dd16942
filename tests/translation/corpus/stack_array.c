// Large arrays on the stack, recursion, and a heap.
#include <kilolib.h>
#include <stdlib.h>
#include <string.h>

static uint8_t *kept;

static uint16_t depth_sum(uint8_t depth) {
    volatile uint8_t room[24];
    memset((uint8_t *)room, depth, sizeof room);
    return depth == 0 ? 0 : room[depth % 24] + depth_sum(depth - 1);
}

static void setup(void) { kept = malloc(200); }

static void loop(void) {
    for (uint8_t i = 0; i < 200; i++) kept[i] += i;
    const uint16_t sum = depth_sum(20) + kept[100];
    set_color(sum >> 3 & 63);
    delay(37);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
