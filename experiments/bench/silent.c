/// Walks, and never says anything: it does not name kilo_message_tx.
#include "walker.h"

int main(void) {
    kilo_init();
    kilo_start(begin_to_walk, walk);
    return 0;
}
