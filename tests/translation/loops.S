; Loops of which a translation leaves out turns (emulator/guest/translated_loops.h), one behind each
; label, with the registers as they are found.

.macro ends
    break
.endm

.rept 52  ; in place of the interrupts' vectors
    break
.endr

; Restoring divisions by a counter, as libgcc's: rest, divisor and quotient of 1, 2, 3 and 4 bytes.
.globl count_1, count_2, count_3, count_4
count_1:
    andi r16, 15
1:  adc r2, r2
    cp r2, r6
    brcs 2f
    sub r2, r6
2:  adc r10, r10
    dec r16
    brne 1b
    ends
count_2:
    andi r16, 31
1:  adc r2, r2
    adc r3, r3
    cp r2, r6
    cpc r3, r7
    brcs 2f
    sub r2, r6
    sbc r3, r7
2:  adc r10, r10
    adc r11, r11
    dec r16
    brne 1b
    ends
count_3:
    andi r16, 31
1:  adc r2, r2
    adc r3, r3
    adc r4, r4
    cp r2, r6
    cpc r3, r7
    cpc r4, r8
    brcs 2f
    sub r2, r6
    sbc r3, r7
    sbc r4, r8
2:  adc r10, r10
    adc r11, r11
    adc r12, r12
    dec r16
    brne 1b
    ends
count_4:
    andi r16, 63
1:  adc r2, r2
    adc r3, r3
    adc r4, r4
    adc r5, r5
    cp r2, r6
    cpc r3, r7
    cpc r4, r8
    cpc r5, r9
    brcs 2f
    sub r2, r6
    sbc r3, r7
    sbc r4, r8
    sbc r5, r9
2:  adc r10, r10
    adc r11, r11
    adc r12, r12
    adc r13, r13
    dec r16
    brne 1b
    ends

; The same with nothing in the rest, as divisions begin.
.globl from_nothing
from_nothing:
    eor r2, r2
    eor r3, r3
    ldi r16, 16
1:  adc r2, r2
    adc r3, r3
    cp r2, r6
    cpc r3, r7
    brcs 2f
    sub r2, r6
    sbc r3, r7
2:  adc r10, r10
    adc r11, r11
    dec r16
    brne 1b
    ends

; Divisions to the mark, as avr-libc's of floats.
.globl mark_3, mark_4
mark_3:
1:  add r2, r2
    adc r3, r3
    adc r4, r4
    cp r2, r6
    cpc r3, r7
    cpc r4, r8
    brcs 2f
    sub r2, r6
    sbc r3, r7
    sbc r4, r8
2:  adc r10, r10
    brcc 1b
    ends
mark_4:
1:  add r2, r2
    adc r3, r3
    adc r4, r4
    adc r5, r5
    cp r2, r6
    cpc r3, r7
    cpc r4, r8
    cpc r5, r9
    brcs 2f
    sub r2, r6
    sbc r3, r7
    sbc r4, r8
    sbc r5, r9
2:  adc r10, r10
    brcc 1b
    ends

; Shifts up to the highest bit, with counters of one byte and of two.
.globl highest_1, highest_2, highest_3, highest_4
highest_1:
1:  dec r16
    add r2, r2
    brpl 1b
    ends
highest_2:
1:  subi r16, 1
    add r2, r2
    adc r3, r3
    brpl 1b
    ends
highest_3:
1:  subi r16, 1
    sbci r17, 0
    add r2, r2
    adc r3, r3
    adc r4, r4
    brpl 1b
    ends
highest_4:
1:  sbiw r24, 1
    add r2, r2
    adc r3, r3
    adc r4, r4
    adc r5, r5
    brpl 1b
    ends

; Counters.
.globl down_1, down_2, down_3
down_1:
1:  dec r16
    brne 1b
    ends
down_2:
1:  sbiw r24, 1
    brne 1b
    ends
down_3:
    andi r18, 1
1:  subi r16, 1
    sbci r17, 0
    sbci r18, 0
    brne 1b
    ends
