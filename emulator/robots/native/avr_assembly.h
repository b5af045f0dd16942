/// AVR instructions that programs write as inline assembly, or by avr-gcc's builtins. Included
/// before every file of a program.
#ifndef KILOTWIN_ROBOTS_NATIVE_AVR_ASSEMBLY_H
#define KILOTWIN_ROBOTS_NATIVE_AVR_ASSEMBLY_H

// As assembly they do nothing: callbacks come between calls of the API anyway, and there is no
// sleep and no watchdog outside the API. Without the macro, cli would be a privileged instruction
// of the PC.
__asm__(".macro sei\n.endm\n"
        ".macro cli\n.endm\n"
        ".macro wdr\n.endm\n"
        ".macro sleep\n.endm\n");

// avr-gcc knows its builtins without any header, so these are declared here.
void kt_sei(void);
void kt_cli(void);
void kt_sleep(void);
void kt_delay(double cycles);

/// Builtins of avr-gcc.
#define __builtin_avr_nop() __asm__ volatile("" ::: "memory")
#define __builtin_avr_sei() kt_sei()
#define __builtin_avr_cli() kt_cli()
#define __builtin_avr_sleep() kt_sleep()
/// No watchdog.
#define __builtin_avr_wdr() ((void)0)
/// Swaps the two halves of a byte.
#define __builtin_avr_swap(byte) \
    ((unsigned char)((unsigned char)(byte) << 4 | (unsigned char)(byte) >> 4))
/// Lets time pass.
#define __builtin_avr_delay_cycles(cycles) kt_delay(cycles)

#endif
