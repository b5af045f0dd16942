/// Finds the way out of a maze, with others: walls stop messages, so these go along corridors only.
///
/// A beacon outside the exit says 0. Each robot says one more than the least that it hears, its
/// guide's, so that the numbers fall towards the exit round all corners. One that hears none walks
/// at random. One that has a number stands and shows it as long as it hears a robot behind, with a
/// higher number or none; then it goes to its guide, and by the guide's guide to the exit. So the
/// chain is taken up from its inner end, and no robot is left behind. At the beacon a robot is out,
/// and walks on in silence.
///
/// LED: red without a number, white while it shows one, green behind its guide, blue when out.
#include "climb.h"
#include "inbox.h"

#define NUMBER 1          // type of all messages: the number, and who says it
#define NONE 60           // as a number: not known
#define SILENT 255        // says nothing
#define NOISE_MM 3        // of distances
#define AGE_TICKS 32      // unit of ages
#define MOST_AGE 80       // of a number, since it left the beacon
#define GUIDE_TICKS 150   // so long a guide's number holds
#define BEHIND_TICKS 300  // so long one is behind that was heard
#define FIRST_TICKS 9000  // so long it waits for the first one behind it
#define LOST_TICKS 3000   // so long it waits for a number that it has lost
#define LEG_TICKS 240     // of a random walk
#define OUT_MM 60         // from the beacon
#define NOBODY 0xFFFE     // no robot's uid, and not the beacon's

typedef enum { SEARCH, SHOW, FOLLOW, OUT } state_t;

static state_t state;
static uint8_t guide_number = NONE, guide_mm, guide_age;
static uint16_t guide_uid = NOBODY;
static uint32_t guide_heard, behind_heard;
static bool is_new;  // of the guide's distance
static bool had_followers;
static uint32_t last_tick, leg_ends, lost_at;
static bool straight;

// Message that it sends, byte by byte, so that the callback may be called at any time.
static message_t said;
static volatile uint8_t said_number = NONE, said_age;

static uint8_t own_number(void) {
    return guide_number < NONE - 1 ? (uint8_t)(guide_number + 1) : NONE;
}

static void take_message(void) {
    const uint16_t uid = (uint16_t)(inbox.data[1] | inbox.data[2] << 8);
    const uint8_t number = inbox.data[0], age = inbox.data[3];
    if (inbox.type != NUMBER) return;
    if (number > own_number() || number == NONE) behind_heard = ticks_now();
    if (number > own_number() && number < NONE) had_followers = true;
    if ((uid != guide_uid && number >= guide_number) || age >= MOST_AGE) return;
    if (guide_uid == NOBODY && state == SEARCH) {
        behind_heard = ticks_now();
        had_followers = false;
    }
    is_new = uid == guide_uid;
    guide_number = number;
    guide_uid = uid;
    guide_age = age;
    guide_mm = inbox_mm;
    guide_heard = ticks_now();
}

static message_t *on_send(void) {
    if (said_number == SILENT) return 0;
    said.data[0] = said_number;
    said.data[3] = said_age;
    said.crc = message_crc(&said);
    return &said;
}

static void walk_at_random(uint32_t now) {
    if ((int32_t)(now - leg_ends) < 0) return;
    straight = !straight;
    if (straight)
        go_straight();
    else
        turn(rand_soft() & 1);
    leg_ends = now + (straight ? LEG_TICKS : rand_soft() / 3);
}

static void enter(state_t next) {
    static const uint8_t colours[] = {RGB(3, 0, 0), RGB(3, 3, 3), RGB(0, 3, 0), RGB(0, 0, 3)};
    state = next;
    set_color(colours[next]);
    if (next == SHOW) set_motors(0, 0);
    if (next == FOLLOW) turn(turns_left);
    leg_ends = ticks_now();
}

static state_t wanted_state(uint32_t now) {
    if (state == OUT || (guide_number == 0 && guide_mm < OUT_MM)) return OUT;
    if (own_number() == NONE) return state != SEARCH && now - lost_at < LOST_TICKS ? SHOW : SEARCH;
    return now - behind_heard < (had_followers ? BEHIND_TICKS : FIRST_TICKS) ? SHOW : FOLLOW;
}

static void setup(void) {
    rand_seed(rand_hard());
    said.type = NUMBER;
    said.data[1] = (uint8_t)kilo_uid;
    said.data[2] = (uint8_t)(kilo_uid >> 8);
    last_tick = ticks_now();
    enter(SEARCH);
}

/// Forgets a number that is too old.
static void age(uint32_t now) {
    const uint32_t own_age = guide_age + (now - guide_heard) / AGE_TICKS;
    if (guide_uid != NOBODY && (now - guide_heard > GUIDE_TICKS || own_age >= MOST_AGE)) {
        guide_number = NONE;
        guide_uid = NOBODY;
        lost_at = now;
    }
    said_age = own_age < MOST_AGE ? (uint8_t)own_age : MOST_AGE;
    said_number = state == OUT ? SILENT : own_number();
}

static void loop(void) {
    const uint32_t now = ticks_now();
    if (inbox_full) {
        take_message();
        inbox_full = false;
    }
    if (now == last_tick) return;
    last_tick = now;
    age(now);
    const state_t next = wanted_state(now);
    if (next != state) enter(next);
    if (state == SEARCH || state == OUT) walk_at_random(now);
    if (state == FOLLOW && is_new) climb((uint16_t)(UINT8_MAX - guide_mm), NOISE_MM);
    is_new = false;
}

int main(void) {
    kilo_message_rx = keep_message;
    kilo_message_tx = on_send;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
