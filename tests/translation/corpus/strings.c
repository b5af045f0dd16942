// Makes texts and takes them apart again.
#include <kilolib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint16_t number;

static void loop(void) {
    char text[24];
    snprintf(text, sizeof text, "n=%u,%c", number, 'a' + number % 26);
    char *comma = strchr(text, ',');
    const int back = atoi(text + 2);
    set_color((back & 15) | (strcmp(comma, ",m") < 0 ? 16 : 0));
    number++;
    delay(70);
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
