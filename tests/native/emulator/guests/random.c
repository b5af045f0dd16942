// Prints what the generators and other pure functions of the API give.
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stdlib.h>
#include <string.h>

static void print_soft(int count) {
    char line[64] = "soft";
    for (int i = 0; i < count; i++) sprintf(line + strlen(line), " %02X", rand_soft());
    printf("%s", line);
}

static void print_rand(void) {
    int draws[4];
    for (int i = 0; i < 4; i++) draws[i] = rand();
    printf("rand %d %d %d %d", draws[0], draws[1], draws[2], draws[3]);
}

static void print_crc(uint8_t fill, int step, uint8_t type) {
    message_t message = {.type = type};
    for (int i = 0; i < 9; i++) message.data[i] = (uint8_t)(fill + step * i);
    printf("crc %04X", message_crc(&message));
}

static void setup(void) {
    if (kilo_uid == 2) {
        rand_seed(1);
        print_soft(8);
        srand(42);
    } else {
        print_soft(16);
    }
    print_rand();
    srand(5);
    print_rand();
    long draws[2] = {random(), random()};
    printf("random %ld %ld, %ld %ld", draws[0], draws[1], (long)RAND_MAX, (long)RANDOM_MAX);
    print_crc(0, 0, 0);
    print_crc(0, 0, 1);
    print_crc(1, 1, 2);
    print_crc(0, 0, 0x88);
    print_crc(255, 0, 0x7F);
    distance_measurement_t near = {33, 33}, far = {800, 800};
    printf("distance %u %u", estimate_distance(&near), estimate_distance(&far));
    printf("sensors %d %d %d", get_ambientlight() >= 0, get_voltage() > 0, get_temperature() > 0);
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
