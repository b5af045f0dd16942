// Goes wrong as configuration[0] says.
#include "module.h"

static uint8_t here[4];

static void endless(void) {
    for (volatile uint32_t i = 0;; i++) {
    }
}

static void setup(void) {}

static void loop(void) {
    switch (configuration[0]) {
    case 1: *(volatile uint8_t *)(here + 40000) = 1; break;
    case 2: endless(); break;
    case 3: exit(1); break;
    case 4:
        while (module_ticks < 1000000) {
        }
        break;
    default: break;
    }
}

int main() {
    module_init();
    module_start(setup, loop);
}
