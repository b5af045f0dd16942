// Mistakes that an AVR does not stop at; a robot with uid 1 makes them at tick 100.
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stddef.h>

typedef struct node {
    uint8_t number;
    struct node *next;
    uint16_t values[8];
    float real;
} node_t;

static node_t *volatile nowhere;
static volatile uint16_t zero;
static volatile int16_t negative = -7;
static volatile int8_t byte = 5;
static volatile long far = 70000;

static void divide(void) {
    const uint16_t thousand = (uint16_t)(1000 + zero);
    printf("%u %u", (uint16_t)(thousand / zero), thousand % zero);
    printf("%d %d", negative / (int16_t)zero, negative % (int16_t)zero);
    printf("%d %d", (int8_t)(byte / (int8_t)zero), (int8_t)(byte % (int8_t)zero));
    printf("%d %d", (int)(far / zero), (int)(far % zero));
}

static void use_null(void) {
    volatile node_t *const node = nowhere;
    node->number = 5;  // at address 0
    node->values[2] = 5;
    node->values[zero + 3] += 7;
    node->real = 2.5f;
    printf("%u %u %d %d", node->values[2], node->values[zero + 3], node->real == 0,
           node->next == NULL);
    for (uint8_t i = 0; i < 8; i++) node->values[i] = i;
    printf("%u", node->number);
    // A register that the instruction itself overwrites.
    const node_t *const next = node->next;
    printf("%d", next == NULL);
}

static void miss(void) {
    static volatile uint8_t array[4];
    volatile uint8_t *const below = array + negative * 200;
    for (uint8_t i = 0; i < 4; i++) below[i] = 5;
    below[zero]++;
    printf("%d %d", below[2], below[zero]);
    static volatile uint16_t words[4];
    static volatile float reals[4];
    const uint16_t before = (uint16_t)(zero - 1);
    array[before] = 5;
    words[before] += 5;
    reals[before] = 5;
    printf("%d %d %d", array[before], words[before], reals[before] == 0);
}

static void setup(void) {}

static void loop(void) {
    static uint32_t last;
    if (kilo_ticks == last) return;
    last = kilo_ticks;
    if (last == 300) printf("lives on");
    if (last != 100 || kilo_uid != 1) return;
    divide();
    use_null();
    miss();
    divide();
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
