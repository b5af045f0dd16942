#include "image.h"

#include <algorithm>

namespace kilotwin {

namespace {

constexpr size_t APPLICATION_BYTES = 220 * 128, RECORD = 0x6F80;

void put_word(uint8_t *bytes, uint16_t word) {
    bytes[0] = static_cast<uint8_t>(word);
    bytes[1] = static_cast<uint8_t>(word >> 8);
}

}  // namespace

uint16_t plain_crc(const uint8_t *bytes, size_t count) {
    uint16_t crc = 0xFFFF;
    while (count-- > 0) {
        crc ^= *bytes++;
        for (int bit = 0; bit < 8; bit++)
            crc = static_cast<uint16_t>(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}

Image::Image(const std::string &program) {
    const auto file = FlashImage::load(program);
    const size_t size = (file->end() + 127) / 128 * 128;
    bytes.assign(file->bytes().begin(), file->bytes().begin() + static_cast<ptrdiff_t>(size));
}

uint16_t Image::crc() const { return plain_crc(bytes.data(), bytes.size()); }
uint16_t Image::page_crc(uint8_t page) const { return plain_crc(&bytes[page * size_t{128}], 128); }

Flash flash_of(const std::string &program) {
    return FlashImage::load_together({program, LOADER})->bytes();
}

Flash flash_with_record(const Image &image) {
    Flash flash = FlashImage::load(LOADER)->bytes();
    std::copy(image.bytes.begin(), image.bytes.end(), flash.begin());
    put_word(&flash[0], 0x940C);
    put_word(&flash[2], 0x7004 / 2);
    put_word(&flash[RECORD], 0xC03F);
    flash[RECORD + 2] = image.pages();
    flash[RECORD + 3] = 1;
    put_word(&flash[RECORD + 4], image.crc());
    std::copy(image.id.begin(), image.id.end(), &flash[RECORD + 6]);
    std::copy_n(image.bytes.begin(), 4, &flash[RECORD + 10]);
    put_word(&flash[RECORD + 14], plain_crc(&flash[RECORD], 14));
    return flash;
}

bool Image::is_in(const Flash &flash) const {
    for (size_t i = 4; i < APPLICATION_BYTES; i++)
        if (flash[i] != (i < bytes.size() ? bytes[i] : 0xFF)) return false;
    return true;
}

}  // namespace kilotwin
