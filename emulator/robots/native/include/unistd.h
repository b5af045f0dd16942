/// Almost empty: a robot has no processes and no files.
#ifndef KT_UNISTD_H
#define KT_UNISTD_H

#include <stddef.h>

typedef long off_t;

#endif
