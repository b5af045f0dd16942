/// Counts its passes in a structure that it has a pointer to.
#include <kilolib.h>

typedef struct {
    uint8_t id;
    uint16_t seen[4];
} state_t;

static state_t state, *mydata = &state;

static void setup(void) { mydata->id = kilo_uid & 3; }

static void loop(void) {
    mydata->seen[mydata->id]++;
    if (mydata->seen[mydata->id] <= 60000) return;
    mydata->seen[mydata->id] = 0;
    set_color(RGB(mydata->id, 1, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
