/// The version of avr-libc whose interface these headers have.
#ifndef KT_AVR_VERSION_H
#define KT_AVR_VERSION_H

#define __AVR_LIBC_VERSION_STRING__ "2.0.0"
#define __AVR_LIBC_VERSION__ 20000UL
#define __AVR_LIBC_MAJOR__ 2
#define __AVR_LIBC_MINOR__ 0
#define __AVR_LIBC_REVISION__ 0

#endif
