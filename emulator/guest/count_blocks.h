/// Counts the program's basic blocks in place. gcc calls __sanitizer_cov_trace_pc() at each; here
/// the assembler turns that call into the decrement itself, and into the call only when the budget
/// is spent. Included before every file of a program that gcc compiles.
#ifndef KILOTWIN_GUEST_COUNT_BLOCKS_H
#define KILOTWIN_GUEST_COUNT_BLOCKS_H

// The call takes one from the budget as well, so that this one is given back first. At the end of a
// function gcc jumps there in place of a call. {disp8} only keeps the assembler from reading its jmp
// as the macro.
__asm__(".hidden kt_budget\n"
        ".macro call target:vararg\n"
        "  .ifc \\target,__sanitizer_cov_trace_pc@PLT\n"
        "    subl $1, kt_budget(%rip)\n"
        "    js 7771f\n"
        "7772:\n"
        "    .subsection 1\n"
        "7771: addl $1, kt_budget(%rip)\n"
        "    callq \\target\n"
        "    {disp8} jmp 7772b\n"
        "    .previous\n"
        "  .else\n"
        "    callq \\target\n"
        "  .endif\n"
        ".endm\n"
        ".macro jmp target:vararg\n"
        "  .ifc \\target,__sanitizer_cov_trace_pc@PLT\n"
        "    subl $1, kt_budget(%rip)\n"
        "    js 7773f\n"
        "    ret\n"
        "    .subsection 1\n"
        "7773: addl $1, kt_budget(%rip)\n"
        "    {disp8} jmp \\target\n"
        "    .previous\n"
        "  .else\n"
        "    {disp8} jmp \\target\n"
        "  .endif\n"
        ".endm\n");

#endif
