/// Counts the turns of the program's loops, in the assembler: it counts the jumps back, since no
/// program goes round without one. Included before every file of a program that gcc compiles.
#ifndef KILOTWIN_GUEST_COUNT_LOOPS_H
#define KILOTWIN_GUEST_COUNT_LOOPS_H

// A label is defined already when the assembler comes to a jump back to it. Jumps to functions (at
// the end of one) and by register may lead back as well. The flags may matter at the target, so they
// are kept, on the stack, below which no red zone lies. {disp8} only keeps the assembler from reading
// a macro's jump as the macro.
__asm__(".hidden kt_budget, kt_budget_spent\n"
        ".macro kt_count_jump target:vararg\n"
        "  pushq %rax\n"
        "  lahf\n"
        "  seto %al\n"
        "  subl $1, kt_budget(%rip)\n"
        "  {disp8} js 7773f\n"
        "7772:\n"
        "  addb $127, %al\n"
        "  sahf\n"
        "  popq %rax\n"
        "  {disp8} jmp \\target\n"
        "7773: callq kt_budget_spent\n"
        "  {disp8} jmp 7772b\n"
        ".endm\n"
        // Sets kt_leads_back to 0 for a label that is still to come, else to 1.
        ".macro kt_see_label label\n"
        "  .ifndef \\label\n"
        "    .set kt_leads_back, 0\n"
        "  .endif\n"
        ".endm\n"
        ".macro kt_see target:vararg\n"
        "  .set kt_leads_back, 2\n"
        "  .irpc first, \\target\n"
        "    .if kt_leads_back == 2\n"
        "      .set kt_leads_back, 1\n"
        "      .ifc \\first,.\n"
        "        kt_see_label \\target\n"
        "      .endif\n"
        "    .endif\n"
        "  .endr\n"
        ".endm\n"
        ".macro jmp target:vararg\n"
        "  kt_see \\target\n"
        "  .if kt_leads_back\n"
        "    kt_count_jump \\target\n"
        "  .else\n"
        "    {disp8} jmp \\target\n"
        "  .endif\n"
        ".endm\n"
        ".irp condition, a,ae,b,be,c,nc,e,ne,z,nz,g,ge,l,le,o,no,s,ns,p,np\n"
        ".macro j\\condition target:vararg\n"
        "  kt_see \\target\n"
        "  .if kt_leads_back\n"
        "    {disp8} j\\condition 7771f\n"
        "    .subsection 1\n"
        "7771: kt_count_jump \\target\n"
        "    .previous\n"
        "  .else\n"
        "    {disp8} j\\condition \\target\n"
        "  .endif\n"
        ".endm\n"
        ".endr\n");

#endif
