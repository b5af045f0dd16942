// Printing by module programs. Linked into those that print only.
#include <stdio.h>

#include "debug.h"

void cprints_no_carriage(const char *text) { printf("%s", text); }
void cprints(const char *text) { printf("%s\n", text); }
void cprinti(int number) { printf("%d\n", number); }
