/* Written as before 1989: no prototypes, no types, parameters declared apart, functions called
   before they are known, main with arguments. Some programs are. */
#include "kilolib.h"
#define DEBUG
#include "debug.h"

message_t message;
static ticks_seen = 0;
message_t message; /* once more */

message_t *answer() { return &message; }

add(a, b) int a;
int b;
{ return a + b; }

setup() {
    kilo_message_tx = answer;
    if (add(2, 3) != 5) printf("FAIL add\n");
    if (later(4) != 8) printf("FAIL later\n");
    show("passed");
}

loop() { ticks_seen = kilo_ticks; }

later(n) { return 2 * n; }

void show(text) char *text;
{ printf("%s\n", text); }

main(argc, argv) int argc;
char **argv;
{
    debug_init();
    kilo_init();
    kilo_start(setup, loop);
}
