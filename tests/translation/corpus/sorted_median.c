// The median of the last readings, by qsort().
#include <kilolib.h>
#include <stdlib.h>
#include <string.h>

static int16_t last[9];
static uint8_t at;

static int by_size(const void *a, const void *b) {
    return *(const int16_t *)a - *(const int16_t *)b;
}

static void loop(void) {
    int16_t sorted[9];
    last[at] = get_ambientlight();
    at = at == 8 ? 0 : at + 1;
    memcpy(sorted, last, sizeof sorted);
    qsort(sorted, 9, sizeof *sorted, by_size);
    set_color(sorted[4] >> 5 & 7);
    delay(45);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
