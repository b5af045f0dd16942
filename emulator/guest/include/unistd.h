/// A robot has no processes and no files: nothing of the PC's is in here.
#ifndef KT_UNISTD_H
#define KT_UNISTD_H

#include <stddef.h>

typedef long off_t;

#endif
