/// Harmful acts, of which ACT is done, once a robot or module. Included by programs that mean harm.
#ifndef ACTS_H
#define ACTS_H

#include "system_call.h"

static signed char did;  ///< what of it succeeded: 0 nothing

static void harm(void) {
    static unsigned char done;
    if (done) return;
    done = 1;
    switch (ACT) {
    case 1: did = call(2, (long)OUTSIDE "/new", 0102, 0644, 0) >= 0; break;  // open
    case 2: did = call(2, (long)VICTIM, 0, 0, 0) >= 0; break;
    case 3: did = call(87, (long)VICTIM, 0, 0, 0) >= 0; break;  // unlink
    case 4:                                                     // fork
        if (call(57, 0, 0, 0, 0) == 0) {
            call(2, (long)OUTSIDE "/new", 0102, 0644, 0);
            call(231, 0, 0, 0, 0);  // exit_group
        }
        break;
    case 5: call(62, call(110, 0, 0, 0, 0), 9, 0, 0); break;  // kill, getppid
    case 6: call(41, 2, 1, 0, 0); break;                      // socket
    }
}

#endif
