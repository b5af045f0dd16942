/// Pushes an object to a lamp, together with others. The object has a beacon, which tells how far
/// away its middle is.
///
/// A robot climbs the light until it hears the beacon. At the object it feels its way: it turns to
/// one side until it begins to leave, then to the other, and compares the light at both. On the
/// object's dark side they are alike: it turns to the beacon and pushes. Elsewhere it slides along
/// the rim to where it is darker. So all come to push towards the lamp. At the lamp a robot turns
/// back, to leave room and to find the object again; at the object it stops when that is there.
///
/// LED: green to the light, blue away from it, red while it feels, white while it pushes, yellow
/// when the object is there.
#include "climb.h"
#include "inbox.h"

#define BEACON 1          // message type
#define HEARD_TICKS 90    // so long after a beacon's message the robot is at the object
#define LEAVING_MM 4      // farther than this from the nearest place: it leaves
#define FEEL_TICKS 150    // no longer
#define QUARTER_TICKS 61  // of a turn: from leaving to pushing
#define SLIDE_TICKS 20    // from leaving to sliding along the rim
#define PUSH_TICKS 180
#define FROM_LAMP_SLIDES 8  // come from the lamp, it slides before it compares

// Sums of eight readings of the light.
#define NOISE_SUM 12
#define ALIKE_SUM 60
#define LAMP_SUM 6600   // brighter than this it is at the lamp
#define THERE_SUM 6000  // and so is the object, if the robot is at its dark side

#define AWAY_TICKS 2500   // back from the lamp, no longer
#define CLIMB_TICKS 4500  // to the lamp, no longer

typedef enum { CLIMB, AWAY, FEEL, BACK, PUSH, THERE } state_t;

static state_t state;
static uint32_t state_since, last_tick;
static uint16_t light;        // the last sum
static uint16_t light_at[2];  // where it left the object to the right and to the left
static uint8_t slides;        // so many before it compares
static uint8_t back_ticks;

// The beacon, as last heard.
static uint8_t beacon_mm, nearest_mm;
static uint32_t heard_at;
static bool ever_heard;

static void take_message(uint32_t now) {
    if (inbox.type != BEACON) return;
    beacon_mm = inbox_mm;
    if (beacon_mm < nearest_mm) nearest_mm = beacon_mm;
    heard_at = now;
    ever_heard = true;
}

static void enter(state_t next) {
    static const uint8_t colours[] = {RGB(0, 3, 0), RGB(0, 0, 3), RGB(3, 0, 0),
                                      RGB(3, 0, 0), RGB(3, 3, 3), RGB(3, 3, 0)};
    state = next;
    state_since = ticks_now();
    set_color(colours[next]);
    if (next == FEEL) nearest_mm = UINT8_MAX;
    if (next == THERE)
        set_motors(0, 0);
    else if (next == PUSH)
        go_straight();
    else
        turn(!turns_left);
}

static void meet_object(void) {
    slides = state == AWAY ? 2 * FROM_LAMP_SLIDES : 0;
    light_at[0] = light_at[1] = light;
    enter(FEEL);
}

/// It leaves the object on one side: pushes, slides on along the rim, or tries the other side.
static void compare_sides(void) {
    const uint16_t here = light_at[turns_left] = light, there = light_at[!turns_left];
    const bool darker = slides > 0 ? slides-- % 2 : here + ALIKE_SUM < there;
    if (!darker && (slides > 0 || there + ALIKE_SUM < here)) {
        enter(FEEL);
    } else if (!darker && light > THERE_SUM) {
        enter(THERE);
    } else {
        back_ticks = darker ? SLIDE_TICKS : QUARTER_TICKS;
        enter(BACK);
    }
}

static void walk(bool at_object, uint32_t in_state, bool is_new) {
    if (at_object)
        meet_object();
    else if (state == CLIMB && (light > LAMP_SUM || in_state > CLIMB_TICKS))
        enter(AWAY);
    else if (state == AWAY && in_state > AWAY_TICKS)
        enter(CLIMB);
    else if (is_new)
        climb(state == AWAY ? (uint16_t)~light : light, NOISE_SUM);
}

static void push(uint32_t in_state) {
    if (state == FEEL && (beacon_mm > nearest_mm + LEAVING_MM || in_state > FEEL_TICKS))
        compare_sides();
    else if (state == BACK && in_state > back_ticks)
        enter(PUSH);
    else if (state == PUSH && in_state > PUSH_TICKS)
        enter(FEEL);
}

static void setup(void) {
    rand_seed(rand_hard());
    turns_left = rand_soft() & 1;
    last_tick = ticks_now();
    enter(CLIMB);
}

static void loop(void) {
    const uint32_t now = ticks_now();
    if (inbox_full) {
        take_message(now);
        inbox_full = false;
    }
    if (now == last_tick) return;
    last_tick = now;
    const uint32_t in_state = now - state_since;
    const bool at_object = ever_heard && now - heard_at < HEARD_TICKS;
    const bool is_new = sum_light(&light);
    if (state == CLIMB || state == AWAY)
        walk(at_object, in_state, is_new);
    else if (!at_object)
        enter(CLIMB);
    else
        push(in_state);
}

int main(void) {
    kilo_message_rx = keep_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
