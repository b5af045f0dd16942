/// Counts loop iterations of a program, in the assembler: every backward jump takes 1 from
/// kt_budget, and 1 more for each 16 bytes of code that it leads back over, and calls
/// kt_budget_spent() below 0 (busy_watch.h). Included before every file of a program that gcc
/// compiles; clang counts basic blocks instead.
///
/// A backward jump costs some instructions more; flags and registers are as without. Loops whose
/// number of turns is known where they begin, which are no busy-waits, are unrolled by the compiler
/// and so jump back less often, but not for less: hence the bytes.
#ifndef KILOTWIN_ROBOTS_NATIVE_COUNT_LOOPS_H
#define KILOTWIN_ROBOTS_NATIVE_COUNT_LOOPS_H

// A jump is backward if its label is defined already when the assembler reads it. Tail calls and
// jumps by register may lead back too, so they count as well. The target may need the flags: they
// are kept on the stack (programs are compiled without a red zone). {disp8} keeps the assembler
// from expanding a jump of a macro as the macro itself. `jmp 0` is a program's own, by which an AVR
// restarts.
__asm__(".hidden kt_budget, kt_budget_spent\n"
        // Takes from the budget, then jumps from 7770 before it; below 0 the call comes first.
        ".macro kt_count_jump target:vararg\n"
        "  pushq %rax\n"
        "  lahf\n"
        "  seto %al\n"
        "  .if kt_leads_back == 1\n"
        "    subl $1 + (7770b - \\target) / 16, kt_budget(%rip)\n"
        "  .else\n"
        "    subl $1, kt_budget(%rip)\n"
        "  .endif\n"
        "  {disp8} js 7773f\n"
        "7772:\n"
        "  addb $127, %al\n"
        "  sahf\n"
        "  popq %rax\n"
        "  {disp8} jmp \\target\n"
        "7773: callq kt_budget_spent\n"
        "  {disp8} jmp 7772b\n"
        ".endm\n"
        // Sets kt_leads_back to 1 if the label is defined already, else to 0.
        ".macro kt_see_label label\n"
        "  .set kt_leads_back, 1\n"
        "  .ifndef \\label\n"
        "    .set kt_leads_back, 0\n"
        "  .endif\n"
        ".endm\n"
        // Sets kt_leads_back: 0 forward, 1 back to a label, 3 not known. Only names are looked up.
        ".macro kt_see target:vararg\n"
        "  .set kt_leads_back, 2\n"
        "  .irpc first, \\target\n"
        "    .if kt_leads_back == 2\n"
        "      .set kt_leads_back, 3\n"
        "      .ifc \\first,.\n"
        "        kt_see_label \\target\n"
        "      .endif\n"
        "    .endif\n"
        "  .endr\n"
        ".endm\n"
        // In place of the instruction; a jump to address 0 returns to it instead.
        ".macro jmp target:vararg\n"
        "  kt_see \\target\n"
        "  .if kt_leads_back\n"
        "    .irp zero, 0,0x0,0x00,0x0000\n"
        "      .ifc \\target,\\zero\n"
        "        pushq $0\n"
        "        retq\n"
        "      .endif\n"
        "    .endr\n"
        "7770: kt_count_jump \\target\n"
        "  .else\n"
        "    {disp8} jmp \\target\n"
        "  .endif\n"
        ".endm\n"
        // Conditional jumps: counting lies out of the way, in another subsection.
        ".irp condition, a,ae,b,be,c,nc,e,ne,z,nz,g,ge,l,le,o,no,s,ns,p,np\n"
        ".macro j\\condition target:vararg\n"
        "  kt_see \\target\n"
        "  .if kt_leads_back\n"
        "7770: {disp8} j\\condition 7771f\n"
        "    .subsection 1\n"
        "7771: kt_count_jump \\target\n"
        "    .previous\n"
        "  .else\n"
        "    {disp8} j\\condition \\target\n"
        "  .endif\n"
        ".endm\n"
        ".endr\n");

#endif
