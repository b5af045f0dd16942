/// A program that does nothing: what the runtime itself takes of the robot, and what a robot gets
/// that shall do no more than obey commands.
#include <kilolib.h>

static void setup(void) {}
static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
