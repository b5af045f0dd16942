// Prints in ways of its own for each uid, and says by its frames how long that took.
#include <avr/io.h>
#define DEBUG
#include <debug.h>
#include <kilolib.h>

void debug_init_nonblocking(void);

static message_t out;
static uint8_t heard;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
    if (kilo_uid == 4) printf("0123456789012345678901234567890123456789");
}

static message_t *send(void) { return &out; }

static void put(char character) {
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = (uint8_t)character;
}

static void setup(void) {
    out.crc = message_crc(&out);
    if (kilo_uid == 1 || kilo_uid == 4) debug_init();
    if (kilo_uid == 2) debug_init_nonblocking();
}

static void loop(void) {
    if (kilo_uid == 4) return;
    if (kilo_uid == 3) {
        for (const char *c = "0123456789"; *c != '\0'; c++) put(*c);
        put('\n');
        return;
    }
    for (uint8_t i = 0; i < 20; i++) printf("%3u heard\n", heard);
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = send;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
