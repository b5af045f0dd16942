/// Draws by rand() in each pass, and looks once a second at what it has drawn.
#include <kilolib.h>
#include <stdlib.h>

static uint32_t last;
static uint8_t drawn;

static void setup(void) {}

static void loop(void) {
    drawn = (uint8_t)(rand() % 100);
    if (kilo_ticks <= last + 31) return;
    last = kilo_ticks;
    set_color(drawn < 50 ? RGB(1, 0, 0) : RGB(0, 0, 1));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
