// A program for a Kilogrid module.
#include <module.h>
#include <moduleLED.h>

static void setup(void) { set_all_LEDs(RED); }

static void loop(void) {}

int main(void) {
    module_init();
    module_start(setup, loop);
}
