// printf() and its like save registers by __prologue_saves__; powf() calls many small functions.
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <math.h>

static char line[60];
static volatile float mean = 3;

static void setup(void) { debug_init(); }

static void loop(void) {
    sprintf(line, "%lu %s %d %d %u", (unsigned long)kilo_uid, "abc", 1, 2, 3U);
    mean = powf(mean, 1.01F) + sinf(mean);
    printf("%ld\n", (long)mean);
    set_color((uint8_t)line[2] & 63);
    delay(30);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
