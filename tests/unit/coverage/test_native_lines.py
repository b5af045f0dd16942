"""Blocks of native code that begin with a call which marks that they have run."""

from kilotwin.programs.coverage.native_lines import blocks

LISTING = """\
0000000000001100 <loop>:
    1100:\tpush   %rbp
    1101:\tcall   2000 <__sanitizer_cov_trace_pc>
    1106:\tcmp    $0x0,%eax
    1109:\tje     1120 <loop+0x20>
    110b:\tcall   2000 <__sanitizer_cov_trace_pc>
    1110:\tcall   1300 <set_color>
    1115:\tcall   2000 <__sanitizer_cov_trace_pc>
    111a:\tnop
    111b:\tjmp    1128 <loop+0x28>
    111d:\tmov    %eax,%ebx
    111f:\tret
0000000000001128 <setup>:
    1128:\tret
"""


def test_a_block_goes_from_its_call_to_the_next_or_to_a_jump() -> None:
    assert list(blocks(LISTING.splitlines())) == [
        (0x1106, 0x1100, 0x110A),
        (0x1110, 0x110B, 0x1115),
        (0x111A, 0x1115, 0x111C),
    ]
