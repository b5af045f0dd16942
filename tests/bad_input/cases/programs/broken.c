#include <kilolib.h>

int main(void) {
    kilo_init();
    start_the_engines();
    return 0
}
