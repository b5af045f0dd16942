// strdup() in the robot's heap. A file of its own, since it needs the heap linked.
#include <stdlib.h>
#include <string.h>

char *strdup(const char *text) {
    char *copy = malloc(strlen(text) + 1);
    return copy == NULL ? NULL : strcpy(copy, text);
}
