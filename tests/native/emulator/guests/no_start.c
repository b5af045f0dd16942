// Forgets kilo_start().
#include <kilolib.h>

int main(void) {
    kilo_init();
    delay(100);
    return 0;
}
