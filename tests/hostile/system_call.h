/// System calls by instruction, past libc. Included by programs that mean harm.
#ifndef SYSTEM_CALL_H
#define SYSTEM_CALL_H

/// The kernel's call `n` with four arguments; the fifth is -1, the sixth 0. Returns what it does.
static long call(long n, long a, long b, long c, long d) {
    register long fourth __asm__("r10") = d, fifth __asm__("r8") = -1, sixth __asm__("r9") = 0;
    long result;
    __asm__ volatile("syscall"
                     : "=a"(result)
                     : "a"(n), "D"(a), "S"(b), "d"(c), "r"(fourth), "r"(fifth), "r"(sixth)
                     : "rcx", "r11", "memory");
    return result;
}

#endif
