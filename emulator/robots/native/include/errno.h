/// errno of avr-libc: a variable of the robot's own.
#ifndef KT_ERRNO_H
#define KT_ERRNO_H

#define EDOM 33
#define ERANGE 34

extern int errno;

#endif
