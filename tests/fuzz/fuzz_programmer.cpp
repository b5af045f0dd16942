/// Fuzz target: the programmer's serial line (STK500 version 2), with any bytes in any pieces.
#include <cassert>
#include <cstdint>

#include "avr/boards/stk500v2.h"

using namespace kilotwin;

namespace {

/// Messages of any body, framed as AVR068 has it: else few would get past the checksum.
Stk500v2::Message framed(std::span<const uint8_t> body, uint8_t sequence) {
    Stk500v2::Message message = {0x1B, sequence, static_cast<uint8_t>(body.size() >> 8),
                                 static_cast<uint8_t>(body.size()), 0x0E};
    message.insert(message.end(), body.begin(), body.end());
    uint8_t sum = 0;
    for (const uint8_t byte : message) sum ^= byte;
    message.push_back(sum);
    return message;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size) {
    if (size == 0) return 0;
    static ChipMemory memory;
    Stk500v2 programmer(memory);
    std::span<const uint8_t> rest(input + 1, size - 1);
    uint8_t sequence = 0;
    while (!rest.empty()) {
        const size_t length = std::min<size_t>(rest.front() + 1U, rest.size());
        const auto piece = rest.first(length);
        rest = rest.subspan(length);
        const bool whole = input[0] % 2 == 1 && length <= Stk500v2::BODY_MOST;
        const auto answer = whole ? programmer.receive(framed(piece.subspan(1), sequence++))
                                  : programmer.receive(piece);
        assert(answer.size() < 70000);
        if (piece.front() == 0xFF) programmer.hang_up();
    }
    return 0;
}
