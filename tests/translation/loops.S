; Loops of which a translation leaves out turns (emulator/robots/translated/passes/loops.h), one
; behind each label, with the registers as they are found. A number of some bytes begins with its lowest one.

.rept 52  ; in place of the interrupts' vectors
    break
.endr

; `first` for the lowest byte, `others` for those above, from registers `to` and `from` on.
.macro chain first, others, bytes, to, from
    \first \to, \from
.set at, 1
.rept \bytes - 1
    \others \to + at, \from + at
.set at, at + 1
.endr
.endm

; A turn of a restoring division up to where its bit goes to the quotient: the rest is in r2, the
; divisor in r6. `first` shifts the lowest byte.
.macro subtract_if_not_less first, bytes
    chain \first, adc, \bytes, 2, 2
    chain cp, cpc, \bytes, 2, 6
    brcs 2f
    chain sub, sbc, \bytes, 2, 6
2:
.endm

; By a counter in r16, as libgcc's; the quotient is in r10.
.macro divide_by_count bytes
1:  subtract_if_not_less adc, \bytes
    chain adc, adc, \bytes, 10, 10
    dec r16
    brne 1b
    break
.endm

; To the mark in r10, as avr-libc's of floats.
.macro divide_to_mark bytes
1:  subtract_if_not_less add, \bytes
    adc r10, r10
    brcc 1b
    break
.endm

; Behind a counter that goes down, up to the highest bit of r2.
.macro shift_to_highest bytes
    chain add, adc, \bytes, 2, 2
    brpl 1b
    break
.endm

.globl count_1, count_2, count_3, count_4
count_1:
    andi r16, 15
    divide_by_count 1
count_2:
    andi r16, 31
    divide_by_count 2
count_3:
    andi r16, 31
    divide_by_count 3
count_4:
    andi r16, 63
    divide_by_count 4

; With nothing in the rest, as divisions begin.
.globl from_nothing
from_nothing:
    eor r2, r2
    eor r3, r3
    ldi r16, 16
    divide_by_count 2

.globl mark_3, mark_4
mark_3:
    divide_to_mark 3
mark_4:
    divide_to_mark 4

.globl highest_1, highest_2, highest_3, highest_4
highest_1:
1:  dec r16
    shift_to_highest 1
highest_2:
1:  subi r16, 1
    shift_to_highest 2
highest_3:
1:  subi r16, 1
    sbci r17, 0
    shift_to_highest 3
highest_4:
1:  sbiw r24, 1
    shift_to_highest 4

.globl down_1, down_2, down_3
down_1:
1:  dec r16
    brne 1b
    break
down_2:
1:  sbiw r24, 1
    brne 1b
    break
down_3:
    andi r18, 1
1:  subi r16, 1
    sbci r17, 0
    sbci r18, 0
    brne 1b
    break
