// Ways not to come back from loop(), one for each uid.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static volatile uint8_t flag;
static volatile uint32_t number;
static uint32_t heard;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    flag = 1;
    heard++;
    if (kilo_uid == 3) printf("heard %lu", (unsigned long)heard);
    if (kilo_uid == 9)
        for (uint32_t now = kilo_ticks; kilo_ticks == now;) {
        }
}

static void compute(uint32_t steps) {
    for (uint32_t i = 0; i < steps; i++) number = number * 1664525 + 1013904223;
}

static void wait_on_a_copy(uint32_t ticks) {
    uint32_t now, end = kilo_ticks + ticks;
    do {
        now = kilo_ticks;
        if (now & 1) number = heard;
    } while (now < end);
}

static void loop(void) {
    uint32_t begin = kilo_ticks;
    switch (kilo_uid) {
    case 1:
        while (kilo_ticks < begin + 100) {
        }
        break;
    case 2:
        flag = 0;
        while (!flag) {
        }
        break;
    case 3:
        for (;;) {
        }
    case 4:
        for (;;) number++;
    case 5:
        for (;;) compute(1);
    case 6: compute(1000000); break;
    case 7: wait_on_a_copy(3000); break;
    case 8:
        while (!flag) set_color(RGB(1, 0, 0));
        break;
    case 9: return;
    case 10:
        for (;;) {
            number++;
            if (kilo_ticks < begin) continue;
            begin = kilo_ticks + 30;
            set_color(number & 1);
        }
    case 12:
        for (;;) delay(0);
    case 13: __asm__ volatile("nop; .byte 0xeb, 0xfd");  // back to the nop, uncounted
    default: delay(1000); return;
    }
    printf("waited %lu until %lu", (unsigned long)(kilo_ticks - begin), (unsigned long)kilo_ticks);
    delay(10);
}

static void setup(void) {}

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
