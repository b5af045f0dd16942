#include "kilo_rand_lib.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

// Robots and modules both have it, by headers of different names.
uint8_t rand_hard(void);

#define PI 3.14159265358979323846
// Largest value of random(), on the robot and in the emulator.
#define RANDOM_MOST 0x7FFFFFFF

void g_ran_set_seed_uint32(uint32_t seed) {
    if (seed == 0)
        for (uint8_t byte = 0; byte < 4; byte++) seed = seed << 8 | rand_hard();
    srandom(seed);
}

double g_ran_uniform(void) { return (double)random() / (double)RANDOM_MOST; }

// random() has 31 bits: the lowest one of the result is always 0.
uint32_t g_ran_uniform_uint32(void) { return (uint32_t)random() << 1; }

// The logarithm of 0 is out of reach: the two ends of the interval are left out.
static double inside(void) { return ((double)random() + 0.5) / ((double)RANDOM_MOST + 1); }

double g_ran_exponential(double lambda) { return -log(inside()) / lambda; }

// Box and Muller's method gives two numbers at a time; the second is kept for the next call.
double g_ran_gaussian(double mu, double sigma) {
    static bool has_second;
    static double second;
    if (has_second) {
        has_second = false;
        return mu + sigma * second;
    }
    const double radius = sqrt(-2 * log(inside()));
    const double angle = 2 * PI * inside();
    second = radius * sin(angle);
    has_second = true;
    return mu + sigma * radius * cos(angle);
}
