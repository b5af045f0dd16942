/// Lines of text on a robot's or module's serial line, from the bytes that its program writes to
/// the UART. Pure.
#ifndef KILOTWIN_BASE_SERIAL_LINE_H
#define KILOTWIN_BASE_SERIAL_LINE_H

#include <cstddef>
#include <cstdint>
#include <string>

namespace kilotwin {

/// Adds a byte to the line, carriage returns left out. True if the line is complete: it ends with
/// this byte, or is 256 bytes long.
inline bool ends_line(std::string &line, uint8_t byte) {
    constexpr size_t LONGEST = 256;
    if (byte != '\r') line += static_cast<char>(byte);
    return byte == '\n' || line.size() >= LONGEST;
}

}  // namespace kilotwin

#endif
