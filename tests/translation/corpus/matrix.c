// A product of matrices on the stack, in ints.
#include <kilolib.h>

static uint16_t passes;

static void loop(void) {
    int a[4][4], b[4][4];
    for (int i = 0; i < 16; i++) {
        a[i / 4][i % 4] = i + (int)passes;
        b[i / 4][i % 4] = i * 3 - 7;
    }
    int trace = 0;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 4; k++) trace += a[i][k] * b[k][i];
    passes++;
    set_color(trace >> 3 & 63);
    delay(20);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
