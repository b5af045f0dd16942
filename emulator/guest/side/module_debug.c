// What a module program prints. Only programs that do so link it.
#include <stdio.h>

#include "debug.h"

void cprints_no_carriage(const char *text) { printf("%s", text); }
void cprints(const char *text) { printf("%s\n", text); }
void cprinti(int number) { printf("%d\n", number); }
