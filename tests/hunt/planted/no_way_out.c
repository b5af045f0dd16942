// A state without a way out: who asked waits for an answer that may never come.
#include <kilolib.h>

enum { ROAM, WAIT };
enum { HELLO, ASK, ANSWER };

static message_t out;
static volatile uint8_t state, partner, has_partner, owes, is_answered;
static uint32_t rests_until;

static message_t *tx(void) { return &out; }

static void rx(message_t *in, distance_measurement_t *d) {
    (void)d;
    if (in->data[1] == (uint8_t)kilo_uid) {
        if (in->data[0] == ASK) owes = in->data[2];
        if (in->data[0] == ANSWER && state == WAIT) is_answered = 1;
    } else {
        partner = in->data[2];
        has_partner = 1;
    }
}

static void say(uint8_t what, uint8_t whom) {
    message_t next = out;
    next.data[0] = what;
    next.data[1] = whom;
    next.data[2] = kilo_uid;
    next.crc = message_crc(&next);
    out = next;
}

static void setup(void) { say(HELLO, 0); }

static void loop(void) {
    if (owes) {
        say(ANSWER, owes);
        owes = 0;
        rests_until = kilo_ticks + 60;
    }
    if (state == WAIT) {
        if (!is_answered) return;
        is_answered = 0;
        state = ROAM;
        rests_until = kilo_ticks + 90;
        set_color(RGB(0, 1, 0));
        say(HELLO, 0);
        return;
    }
    if (kilo_ticks < rests_until) return;
    if (out.data[0] == ANSWER) say(HELLO, 0);
    if (has_partner && (kilo_uid & 1)) {
        has_partner = 0;
        state = WAIT;
        set_color(RGB(1, 1, 0));
        say(ASK, partner);
    }
}

int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
