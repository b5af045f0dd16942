// The same for modules of a Kilogrid.
#include <kilogrid.h>
#include <module.h>
#include <moduleIR.h>
#include <moduleLED.h>

#include "acts.h"

#define AT(moment) \
    if (MOMENT == (moment)) harm()

__attribute__((constructor)) static void constructor(void) { AT(5); }

static void setup(void) { AT(10); }

static void loop(void) { AT(11); }

int main(void) {
    AT(13);
    module_init();
    AT(14);
    module_enable_autostart();
    module_start(setup, loop);
    return 0;
}
