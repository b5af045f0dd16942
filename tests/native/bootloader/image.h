/// Programs as senders of images have them, and chips that hold one beside the loader (LOADER).
#ifndef KILOTWIN_TESTS_BOOTLOADER_IMAGE_H
#define KILOTWIN_TESTS_BOOTLOADER_IMAGE_H

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "avr/chip/flash_image.h"

namespace kilotwin {

using Flash = std::array<uint8_t, FlashImage::BYTES>;

/// An image as it is sent: whole pages.
struct Image {
    explicit Image(const std::string &program);
    uint8_t pages() const { return static_cast<uint8_t>(bytes.size() / 128); }
    uint16_t crc() const;
    uint16_t page_crc(uint8_t page) const;
    /// Whether an application's part of the flash has it and nothing else, but for the vector.
    bool is_in(const Flash &flash) const;

    std::vector<uint8_t> bytes;
    std::array<uint8_t, 4> id{0x11, 0x22, 0x33, 0x44};
};

/// Flash as avrdude alone leaves it, with the loader.
Flash flash_of(const std::string &program);
/// Flash as the loader leaves it, or an ISP programmer with kilotwin's help.
Flash flash_with_record(const Image &image);

/// CRC-16 of some bytes, bit by bit.
uint16_t plain_crc(const uint8_t *bytes, size_t count);

}  // namespace kilotwin

#endif
