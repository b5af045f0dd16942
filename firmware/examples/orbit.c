/// Orbits: goes round a planet at about 60 mm, the planet on its left.
///
/// The robot with uid 1 is the planet: it stands still and speaks four times as often as usual. An
/// orbiter cannot tell where the planet is, only how far. So it steers by the distance and by how
/// that changes: too far, and not coming closer, it turns left; too near, and not going away,
/// right. A turn leads forwards too, for one motor alone turns the robot about a leg.
///
/// LED of an orbiter: green within 10 mm of its way, red farther out, blue farther in; off while it
/// has not heard the planet for two seconds. LED of the planet: white.
#include <kilolib.h>
#include <stdbool.h>
#include <stddef.h>

#define TYPE_PLANET 2
#define PLANET_UID 1
#define PLANET_PERIOD 976  // units of 128 us: every fourth tick
#define ORBIT_MM 60
#define BAND_MM 10
#define ERROR_MAX_MM 8  // an error counts for no more, or the change would never count
#define AVERAGE_OF 8    // messages: about the last second
#define LOST_TICKS (2 * TICKS_PER_SEC)

typedef enum { STAND, LEFT, RIGHT } motion_t;

static message_t message;

// From the callback to loop(), a byte each: the distance, then word that there is one.
static volatile uint8_t measured_mm;
static volatile bool measured;

static motion_t motion = STAND;
static bool known;
static int16_t average_q4;  // of the distance, in sixteenths of a millimetre
static uint32_t heard_at;

static void on_message(message_t *received, distance_measurement_t *distance) {
    if (received->type != TYPE_PLANET) return;
    measured_mm = estimate_distance(distance);
    measured = true;
}

static message_t *on_transmit(void) { return kilo_uid == PLANET_UID ? &message : NULL; }

// An interrupt counts the four bytes up: read until two readings agree.
static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

// A motor that stood still needs a push.
static void turn(motion_t wanted) {
    if (wanted == motion) return;
    motion = wanted;
    spinup_motors();
    set_motors(motion == LEFT ? kilo_turn_left : 0, motion == RIGHT ? kilo_turn_right : 0);
}

static void steer(int16_t mm) {
    int16_t error = (int16_t)(mm - ORBIT_MM);
    set_color(error > BAND_MM ? RGB(3, 0, 0) : error < -BAND_MM ? RGB(0, 0, 3) : RGB(0, 3, 0));
    if (error > ERROR_MAX_MM) error = ERROR_MAX_MM;
    if (error < -ERROR_MAX_MM) error = -ERROR_MAX_MM;

    if (!known) average_q4 = (int16_t)(mm * 16);
    known = true;
    const int16_t change_q4 = (int16_t)(mm * 16 - average_q4);
    average_q4 = (int16_t)(average_q4 + change_q4 / AVERAGE_OF);
    turn(error * 16 + change_q4 > 0 ? LEFT : RIGHT);
}

static void setup(void) {
    if (kilo_uid == PLANET_UID) set_color(RGB(3, 3, 3));
}

static void loop(void) {
    if (kilo_uid == PLANET_UID) return;
    if (measured) {
        measured = false;
        heard_at = ticks_now();
        steer(measured_mm);
    } else if (known && ticks_now() - heard_at > LOST_TICKS) {
        known = false;  // it keeps turning: a circle leads back to where it heard the planet
        set_color(RGB(0, 0, 0));
    }
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = on_transmit;
    kilo_init();

    if (kilo_uid == PLANET_UID) kilo_tx_period = PLANET_PERIOD;
    message.type = TYPE_PLANET;
    message.crc = message_crc(&message);

    kilo_start(setup, loop);
    return 0;
}
