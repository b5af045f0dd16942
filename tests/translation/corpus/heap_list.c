// Keeps a list on the heap that grows and is freed.
#include <kilolib.h>
#include <stdlib.h>

struct item {
    struct item *next;
    uint8_t value;
};
static struct item *first;
static uint8_t count;

static void setup(void) {}

static void loop(void) {
    struct item *item = malloc(sizeof *item);
    if (item == 0 || count == 40) {
        free(item);
        while (first) {
            struct item *next = first->next;
            free(first);
            first = next;
        }
        count = 0;
        set_color(RGB(1, 0, 0));
    } else {
        item->next = first;
        item->value = ++count;
        first = item;
        set_color(item->value & 3);
    }
    delay(30);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
