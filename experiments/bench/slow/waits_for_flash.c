/// Erases a page of its flash, and waits for that.
#include <avr/boot.h>
#include <kilolib.h>

static void setup(void) {
    boot_page_erase(0x6000);
    boot_spm_busy_wait();
    set_color(RGB(0, 1, 0));
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
