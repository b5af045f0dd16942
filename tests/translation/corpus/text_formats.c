// Makes text of numbers and decides by it.
#include <kilolib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int16_t number = -300;

static void setup(void) {}

static void loop(void) {
    char text[24];
    snprintf(text, sizeof text, "%d:%04x:%5u", number, (unsigned)number, (unsigned)number / 3);
    uint8_t sum = 0;
    for (uint8_t i = 0; i < strlen(text); i++) sum += text[i];
    set_color(sum & 63);
    number += atoi(text) < 0 ? 37 : 41;
    delay(45);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
