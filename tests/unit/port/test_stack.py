"""How deep the stack gets, by the machine code as avr-objdump prints it."""

import re

from kilotwin.programs.port.disassembly import Disassembly, Place, parse
from kilotwin.programs.port.roles import Roles
from kilotwin.programs.port.stack import StackBound, bound

NOBODY = Roles(frozenset(), frozenset(), {})
SAVES = """
__prologue_saves__:
    push r15
    push r16
    push r17
    push r28
    push r29
    in r28, 0x3d
    in r29, 0x3e
    sub r28, r26
    sbc r29, r27
    in r0, 0x3f
    cli
    out 0x3e, r29
    out 0x3f, r0
    out 0x3d, r28
    ijmp
__epilogue_restores__:
    ldd r15, Y+5
    ldd r16, Y+4
    ldd r17, Y+3
    ldd r26, Y+2
    ldd r27, Y+1
    add r28, r30
    adc r29, r1
    in r0, 0x3f
    cli
    out 0x3e, r29
    out 0x3f, r0
    out 0x3d, r28
    movw r28, r26
    ret
"""


def objdump(assembly: str) -> str:
    """As it prints this, from 0x100 on, each of two bytes; a label with a dot is no function's."""
    lines = [line.strip() for line in assembly.strip().splitlines()]
    addresses: dict[str, int] = {}
    functions: dict[int, str] = {}
    code: list[str] = []
    for line in lines:
        if line.endswith(":"):
            addresses[line[:-1]] = 0x100 + 2 * len(code)
            if not line.startswith("."):
                functions[0x100 + 2 * len(code)] = line[:-1]
        else:
            code.append(line)
    printed = []
    for index, line in enumerate(code):
        address = 0x100 + 2 * index
        if address in functions:
            printed.append(f"{address:08x} <{functions[address]}>:")
        name, _, operands = line.partition(" ")
        if jump := re.fullmatch(r"(.*?)(?:\+(\d+))?", operands):
            label, ahead = jump[1], int(jump[2] or 0)
            if label in addresses:
                target = addresses[label] + ahead
                entry = max(start for start in functions if start <= target)
                offset = f"+{target - entry:#x}" if target > entry else ""
                operands = f".+0\t; {target:#x} <{functions[entry]}{offset}>"
        if not operands.startswith("."):
            operands = re.sub(
                r"(lo|hi)\((\.?\w+)\)",
                lambda half: f"0x{addresses[half[2]] // 2 >> 8 * (half[1] == 'hi') & 0xFF:02X}",
                operands,
            )
        printed.append(f"/a/b.c:{index + 1}")
        printed.append(f" {address:x}:\t00 00 \t{name}\t{operands}")
    return "\n".join(printed)


def stack(
    assembly: str, roles: Roles = NOBODY, pointers: frozenset[str] = frozenset()
) -> StackBound:
    nothing: frozenset[str] = frozenset()
    functions = parse(objdump(assembly))
    return bound(Disassembly(functions, {}, 0, 0, pointers, nothing, nothing), roles)


def frame(size: str, code: str) -> str:
    """A function's code with a frame of so many bytes, as the compiler makes it."""
    write = "in r0, 0x3f\ncli\nout 0x3e, r29\nout 0x3f, r0\nout 0x3d, r28"
    return f"push r28\npush r29\nin r28, 0x3d\nin r29, 0x3e\n{size}\n{write}\n{code}"


def test_the_common_prologue_pushes_and_makes_the_frame_of_who_jumps_to_it() -> None:
    text = """
        main:
            ldi r26, 0x0B
            ldi r27, 0x01
            ldi r30, lo(.back)
            ldi r31, hi(.back)
            rjmp __prologue_saves__+4
        .back:
            rcall leaf
            subi r28, 0xF5
            sbci r29, 0xFE
            ldi r30, 0x03
            rjmp __epilogue_restores__+4
        leaf:
            push r17
            pop r17
            ret
    """
    # Return address, three of five registers, the frame; what it calls.
    assert stack(text + SAVES) == StackBound(2 + 3 + 0x10B + 3, "main > leaf")


def test_frames_are_read_from_how_they_are_made() -> None:
    assert stack("main:\n" + frame("sbiw r28, 0x21", "ret")).bytes == 4 + 0x21
    assert stack("main:\n" + frame("subi r28, 0xBC\nsbci r29, 0x02", "ret")).bytes == 4 + 0x2BC
    assert stack("main:\n" + frame("subi r28, 0xC8\nsbc r29, r1", "ret")).bytes == 4 + 200
    assert stack("main:\nrcall .room\n.room:\npush r1\npop r0\npop r0\npop r0\nret").bytes == 5


def test_arguments_that_are_off_the_stack_again_do_not_count() -> None:
    call = "push r24\npush r25\nrcall print\n"
    take_off = "in r24, 0x3d\nin r25, 0x3e\nadiw r24, 0x02\nout 0x3e, r25\nout 0x3d, r24\n"
    twice = f"main:\n{(call + take_off) * 2}ret\nprint:\nret"
    assert stack(twice).bytes == 2 + 2 + 2
    assert stack(f"main:\n{call * 2}ret\nprint:\nret").bytes == 2 + 4 + 2


def test_who_is_called_last_has_no_return_address_of_its_own() -> None:
    text = "main:\npush r28\npop r28\nrjmp last\nlast:\npush r16\npush r17\npop r17\npop r16\nret"
    assert stack(text) == StackBound(4, "main > last")


def test_one_function_may_run_on_into_the_next_or_be_called_in_its_middle() -> None:
    text = (
        "main:\nrcall first+2\nret\nfirst:\nnop\npush r16\nsecond:\npush r17\npop r17\npop r16\nret"
    )
    assert stack(text).bytes == 2 + 2 + 2


def test_what_stands_behind_a_call_that_does_not_come_back_is_not_reached() -> None:
    text = "main:\nrcall stop\nother:\npush r16\nrcall main\nstop:\n.on:\nrjmp .on"
    assert stack(text) == StackBound(4, "main > stop")


def test_the_cases_of_a_switch_are_followed() -> None:
    text = """
        main:
            cpi r24, 0x09
            brcs .table
            ret
        .table:
            rjmp __tablejump2__
            push r16
            rcall deep
            pop r16
            ret
            rjmp deep
        deep:
            push r17
            pop r17
            ret
        __tablejump2__:
            lpm r0, Z+
            lpm r31, Z
            mov r30, r0
            ijmp
    """
    assert stack(text) == StackBound(2 + 1 + 3, "main > deep")


def test_a_call_by_address_means_any_function_whose_address_is_taken() -> None:
    text = (
        "main:\nicall\nldd r30, Z+1\nijmp\none:\nret\nother:\npush r2\nret\nmore:\nrcall one\nret"
    )
    assert stack(text, pointers=frozenset({"one", "other"})) == StackBound(5, "main > other")


def test_a_call_to_nobody_known_and_room_that_is_given_back_at_once_count() -> None:
    assert stack("main:\nicall\nret") == StackBound(4, "main")
    assert stack("main:\nrcall .room\n.room:\npop r0\npop r0\nret").bytes == 4


def test_a_size_that_is_computed_at_run_time_has_no_bound() -> None:
    text = """
        main:
            rcall loop
            ret
        loop:
            in r18, 0x3d
            in r19, 0x3e
            sub r18, r24
            sbc r19, r1
            in r0, 0x3f
            cli
            out 0x3e, r19
            out 0x3f, r0
            out 0x3d, r18
            ret
    """
    found = stack(text)
    assert found.bytes is None
    assert found.why.startswith("how much loop() takes is known only when it runs")
    assert "fixed length" in found.do
    assert found.place == Place("/a/b.c", 11)


def test_a_size_that_is_known_has_a_bound_unless_a_loop_takes_it_again() -> None:
    take = "in r24, 0x3d\nin r25, 0x3e\nsbiw r24, 0x0a\nout 0x3e, r25\nout 0x3d, r24\n"
    once = (
        f"main:\nin r28, 0x3d\nin r29, 0x3e\n{take}rcall leaf\nout 0x3e, r29\nout 0x3d, r28\nret\n"
    )
    assert stack(once + "leaf:\nret").bytes == 2 + 10 + 2
    again = stack(f"main:\n.again:\n{take}brne .again\nret")
    assert again.bytes is None
    assert "main()" in again.why


def test_setjmp_returns_and_longjmp_leaves() -> None:
    text = """
        main:
            rcall setjmp
            rcall longjmp
            push r2
            rcall main
        setjmp:
            pop r31
            pop r30
            in r24, 0x3d
            st X+, r24
            in r24, 0x3e
            st X+, r24
            ijmp
        longjmp:
            ld r30, X+
            ld r31, X+
            out 0x3e, r31
            out 0x3d, r30
            ld r30, X+
            ld r31, X+
            ijmp
    """
    assert stack(text, pointers=frozenset({"main"})).bytes == 4


def test_the_deepest_interrupt_comes_on_top() -> None:
    text = "main:\nrcall leaf\nret\nleaf:\nret\n__vector_11:\nreti\n__vector_14:\npush r1\nreti"
    assert stack(text) == StackBound(4 + 3, "main > leaf, interrupted by __vector_14")


def test_a_recursion_has_no_bound() -> None:
    found = stack("main:\nrcall one\nret\none:\nrcall other\nret\nother:\nrjmp main")
    assert found.bytes is None
    found = stack("main:\nrcall one\nret\none:\nrcall other\nret\nother:\nrcall one\nret")
    assert found == StackBound(None, "it calls itself: one > other > one", found.do)
    assert "loop" in found.do
