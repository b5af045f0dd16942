/// System calls by instruction, past libc. Included by programs that mean harm.
#ifndef SYSTEM_CALL_H
#define SYSTEM_CALL_H

#ifndef __x86_64__  // a robot has none
#define call6(n, a, b, c, d, e, f) ((void)(a), -1)
#define call(n, a, b, c, d) ((void)(a), -1)
#else
/// The kernel's call `n`. Returns what it does.
static long call6(long n, long a, long b, long c, long d, long e, long f) {
    register long fourth __asm__("r10") = d, fifth __asm__("r8") = e, sixth __asm__("r9") = f;
    long result;
    __asm__ volatile("syscall"
                     : "=a"(result)
                     : "a"(n), "D"(a), "S"(b), "d"(c), "r"(fourth), "r"(fifth), "r"(sixth)
                     : "rcx", "r11", "memory");
    return result;
}

/// The same with four arguments; the fifth is -1, the sixth 0.
static inline long call(long n, long a, long b, long c, long d) {
    return call6(n, a, b, c, d, -1, 0);
}
#endif

#endif
