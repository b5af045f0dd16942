// A robot that walks straight and tells its cell every 2 s where its program thinks it is: on which
// site, by the last message of a cell. Number in the first byte, as labs do.
#include <kilolib.h>

#define TRACKING_TYPE 0x10
#define PERIOD_TICKS 61

static message_t report;
static uint8_t waiting, site;
static uint32_t last;

static message_t *give(void) { return waiting ? &report : 0; }
static void given(void) { waiting = 0; }

static void on_message(message_t *m, distance_measurement_t *d) {
    (void)d;
    if (m->type == 0x01) site = m->data[0];
}

static void setup(void) { last = kilo_ticks; }

static void loop(void) {
    set_color(site == 1 ? RGB(1, 0, 0) : site == 2 ? RGB(0, 1, 0) : RGB(0, 0, 0));
    set_motors(kilo_straight_left, kilo_straight_right);
    if (kilo_ticks - last < PERIOD_TICKS) return;
    last = kilo_ticks;
    report.data[0] = (uint8_t)kilo_uid;
    report.data[1] = (uint8_t)(kilo_uid >> 8);
    report.data[2] = site == 1 ? RGB(1, 0, 0) : site == 2 ? RGB(0, 1, 0) : RGB(0, 0, 0);
    report.data[3] = site;
    report.type = TRACKING_TYPE;
    report.crc = message_crc(&report);
    waiting = 1;
}

int main(void) {
    kilo_init();
    kilo_message_tx = give;
    kilo_message_tx_success = given;
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
