// The part of the thin half that guests of robots and modules share: guard pages around the
// variables, the budget of loop iterations, random bytes, and calls to the engine through
// `kt_host`.
#include <stddef.h>

#include "abi.h"
#include "side.h"

const kt_host_t *kt_host KT_SHARED = NULL;
int32_t kt_budget KT_SHARED = 0;

char kt_guard_low[KT_GUARD_BYTES]
    __attribute__((aligned(4096), used, section(".kt_guard_low"))) = {0};
char kt_guard_high[KT_GUARD_BYTES]
    __attribute__((aligned(4096), used, section(".kt_guard_high"))) = {0};

volatile kt_outputs_t kt_outputs;

// Called where the budget runs out, between any two instructions: saves and restores all registers.
// They lie on the stack meanwhile, where the engine compares them: loop variables may live in
// registers only (busy_watch.h).
void kt_budget_spent(void);
__asm__(".pushsection .text\n"
        ".globl kt_budget_spent\n"
        ".hidden kt_budget_spent\n"
        ".type kt_budget_spent, @function\n"
        "kt_budget_spent:\n"
        "  pushq %rax; pushq %rcx; pushq %rdx; pushq %rbx; pushq %rbp; pushq %rsi; pushq %rdi\n"
        "  pushq %r8; pushq %r9; pushq %r10; pushq %r11; pushq %r12; pushq %r13; pushq %r14; pushq "
        "%r15\n"
        "  subq $256, %rsp\n"
        "  movups %xmm0, (%rsp); movups %xmm1, 16(%rsp); movups %xmm2, 32(%rsp); movups %xmm3, "
        "48(%rsp)\n"
        "  movups %xmm4, 64(%rsp); movups %xmm5, 80(%rsp); movups %xmm6, 96(%rsp); movups %xmm7, "
        "112(%rsp)\n"
        "  movups %xmm8, 128(%rsp); movups %xmm9, 144(%rsp); movups %xmm10, 160(%rsp); movups "
        "%xmm11, 176(%rsp)\n"
        "  movups %xmm12, 192(%rsp); movups %xmm13, 208(%rsp); movups %xmm14, 224(%rsp); movups "
        "%xmm15, 240(%rsp)\n"
        "  movq %rsp, %rbx\n"
        "  movq %rsp, %rdi\n"
        "  andq $-16, %rsp\n"
        "  call kt_report_spent\n"
        "  movq %rbx, %rsp\n"
        "  movups (%rsp), %xmm0; movups 16(%rsp), %xmm1; movups 32(%rsp), %xmm2; movups 48(%rsp), "
        "%xmm3\n"
        "  movups 64(%rsp), %xmm4; movups 80(%rsp), %xmm5; movups 96(%rsp), %xmm6; movups "
        "112(%rsp), %xmm7\n"
        "  movups 128(%rsp), %xmm8; movups 144(%rsp), %xmm9; movups 160(%rsp), %xmm10; movups "
        "176(%rsp), %xmm11\n"
        "  movups 192(%rsp), %xmm12; movups 208(%rsp), %xmm13; movups 224(%rsp), %xmm14; movups "
        "240(%rsp), %xmm15\n"
        "  addq $256, %rsp\n"
        "  popq %r15; popq %r14; popq %r13; popq %r12; popq %r11; popq %r10; popq %r9; popq %r8\n"
        "  popq %rdi; popq %rsi; popq %rbp; popq %rbx; popq %rdx; popq %rcx; popq %rax\n"
        "  ret\n"
        ".size kt_budget_spent, . - kt_budget_spent\n"
        ".popsection\n");

static __attribute__((used)) void report_spent(const uint8_t *frame) __asm__("kt_report_spent");
static void report_spent(const uint8_t *frame) { kt_host->spent(frame); }

/// Called by clang's instrumentation at every basic block of the program. gcc's programs do not
/// call it (count_loops.h).
void __sanitizer_cov_trace_pc(void);
#ifdef KT_COVERED
// Where a program is built to be covered (guest.py), the calls that have run, of all robots,
// by the addresses in the file that they return to. gcc's programs call it only then.
__attribute__((visibility("default"))) uint8_t kt_coverage[KT_COVERED] KT_SHARED = {0};
extern const char __ehdr_start[] __attribute__((visibility("hidden")));

void __sanitizer_cov_trace_pc(void) {
    const size_t at = (size_t)((const char *)__builtin_return_address(0) - __ehdr_start);
    if (at < sizeof kt_coverage) kt_coverage[at] = 1;
#ifdef __clang__
    if (--kt_budget < 0) kt_budget_spent();
#endif
}
#else
void __sanitizer_cov_trace_pc(void) {
    if (--kt_budget < 0) kt_budget_spent();
}
#endif

uint8_t rand_hard(void);
uint8_t rand_hard(void) { return kt_host->rand_hard(); }

extern void (*const kt_constructors_begin[])(void);
extern void (*const kt_constructors_end[])(void);

int kt_run_program() {
    for (void (*const *constructor)(void) = kt_constructors_begin;
         constructor < kt_constructors_end; constructor++)
        (*constructor)();
    return kt_guest_main();
}

uint32_t kt_ticks(void) { return *kt_table.ticks; }
void kt_print(const char *text, uint32_t bytes, uint8_t line) { kt_host->print(text, bytes, line); }
void kt_serial_written(void) { kt_host->serial_written(); }
void kt_serial_ready(void) { kt_host->serial_ready(); }
uint8_t kt_eeprom_read(uint16_t address) { return kt_host->eeprom_read(address); }
void kt_eeprom_write(uint16_t address, uint8_t value) { kt_host->eeprom_write(address, value); }
void kt_interrupts(uint8_t on) { kt_host->interrupts(on); }
uint8_t kt_timer0(void) { return kt_host->timer0(); }
void kt_wait(uint32_t cycles) { kt_host->wait(cycles); }
void kt_unusable(const char *what) {
    kt_host->unusable(what);
    for (;;) {
    }
}
