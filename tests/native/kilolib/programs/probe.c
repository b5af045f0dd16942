/// Lays the Kilobot API open to the tests: a test writes a request, loop() carries it out and
/// leaves what came of it in `result`; callbacks count and keep what they get.
#include <kilolib.h>
#include <stddef.h>

enum {
    NOTHING,
    RAND_SOFT,
    RAND_SEED,
    RAND_HARD,
    CRC,
    DISTANCE,
    LIGHT,
    VOLTAGE_READING,
    TEMPERATURE,
    DELAY,
    COLOR,
    MOTORS,
    SPINUP,
};

volatile uint8_t request;
volatile uint16_t argument;
volatile int16_t result[2];
volatile uint32_t loops;
volatile uint8_t setups;

volatile uint16_t received_count;
message_t last_message;
distance_measurement_t last_distance;

volatile uint8_t talks;  // messages to send
volatile uint8_t asked, sent;
message_t outgoing;
distance_measurement_t gains;

static void on_message(message_t *message, distance_measurement_t *distance) {
    last_message = *message;
    last_distance = *distance;
    received_count++;
}

static message_t *next_message(void) {
    asked++;
    return talks > 0 ? &outgoing : NULL;
}

static void on_sent(void) {
    sent++;
    if (talks != 255) talks--;
}

static void carry_out(void) {
    switch (request) {
    case RAND_SOFT: result[0] = rand_soft(); break;
    case RAND_SEED: rand_seed((uint8_t)argument); break;
    case RAND_HARD: result[0] = rand_hard(); break;
    case CRC: result[0] = (int16_t)message_crc(&outgoing); break;
    case DISTANCE: result[0] = estimate_distance(&gains); break;
    case LIGHT: result[0] = get_ambientlight(); break;
    case VOLTAGE_READING: result[0] = get_voltage(); break;
    case TEMPERATURE: result[0] = get_temperature(); break;
    case DELAY: delay(argument); break;
    case COLOR: set_color((uint8_t)argument); break;
    case MOTORS: set_motors((uint8_t)argument, (uint8_t)(argument >> 8)); break;
    case SPINUP: spinup_motors(); break;
    default: return;
    }
    request = NOTHING;
}

static void setup(void) { setups++; }

static void loop(void) {
    loops++;
    carry_out();
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = next_message;
    kilo_message_tx_success = on_sent;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
