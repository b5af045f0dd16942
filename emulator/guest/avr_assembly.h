/// Instructions of the AVR that programs write as assembly, or by the names that avr-gcc itself has
/// for them. Included before every file of a program.
#ifndef KILOTWIN_GUEST_AVR_ASSEMBLY_H
#define KILOTWIN_GUEST_AVR_ASSEMBLY_H

// As assembly they do nothing: a callback comes between calls of the API anyway, and nothing else
// sleeps or resets. cli would be an instruction of the PC, and a privileged one.
__asm__(".macro sei\n.endm\n"
        ".macro cli\n.endm\n"
        ".macro wdr\n.endm\n"
        ".macro sleep\n.endm\n");

// By name they are known without any header.
void kt_sei(void);
void kt_cli(void);
void kt_sleep(void);
void kt_delay(double cycles);

#define __builtin_avr_nop() __asm__ volatile("" ::: "memory")
#define __builtin_avr_sei() kt_sei()
#define __builtin_avr_cli() kt_cli()
#define __builtin_avr_sleep() kt_sleep()
#define __builtin_avr_wdr() ((void)0)
#define __builtin_avr_swap(byte) \
    ((unsigned char)((unsigned char)(byte) << 4 | (unsigned char)(byte) >> 4))
#define __builtin_avr_delay_cycles(cycles) kt_delay(cycles)

#endif
