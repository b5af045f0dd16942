/// Instructions of the AVR that programs write as assembly. They do nothing: a callback comes
/// between calls of the API anyway, and nothing else sleeps or resets. Included before every file of
/// a program; cli would be an instruction of the PC, and a privileged one.
#ifndef KILOTWIN_GUEST_AVR_ASSEMBLY_H
#define KILOTWIN_GUEST_AVR_ASSEMBLY_H

__asm__(".macro sei\n.endm\n"
        ".macro cli\n.endm\n"
        ".macro wdr\n.endm\n"
        ".macro sleep\n.endm\n");

#endif
