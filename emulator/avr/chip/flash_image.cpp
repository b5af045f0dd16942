#include "avr/chip/flash_image.h"

#include <elf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "avr/chip/translated_core.h"
#include "base/errors.h"
#include "base/registers.h"
#include "kilolib/core/eeprom_map.h"

namespace kilotwin {

namespace {

constexpr uint16_t ELF_MACHINE_AVR = 83;
// avr-gcc's address spaces in one: SRAM and EEPROM lie far above the flash in ELF files, and the
// EEPROM also in hex files made of them by objcopy. Fuses, lock bits and signature follow.
constexpr uint32_t SRAM_BASE = 0x800000, EEPROM_BASE = 0x810000, FUSE_BASE = 0x820000;
constexpr ptrdiff_t APPLICATION_BYTES = 220 * 128;  // pages that a robot takes (hardware.md 1.11)
// The ATmega328P's interrupt vectors, from address 0 on.
constexpr size_t VECTORS = 26, SERIAL_RECEIVE_VECTOR = 18;
constexpr std::string_view TRANSLATION_SUFFIX = ".so";
constexpr uint32_t BOOT_SECTIONS[] = {0x7000, 0x7800, 0x7C00, 0x7E00};

enum HexRecord : uint8_t {
    DATA,
    END_OF_FILE,
    SEGMENT_ADDRESS,
    SEGMENT_START,
    LINEAR_ADDRESS,
    LINEAR_START
};

std::string content_of(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    std::string content(std::istreambuf_iterator<char>(file), {});
    if (!file) throw EngineError(path + " cannot be read");
    return content;
}

/// -1: no hexadecimal digit.
int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return -1;
}

std::string in_hex(uint32_t value) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%X", value);
    return text;
}

/// Parses one record of Intel HEX, checksum included. Its bytes: count, address (2), type, data,
/// checksum. `where` is its file and line.
std::vector<uint8_t> record_of(const std::string &line, const std::string &where) {
    constexpr size_t RECORD_FRAME_BYTES = 5;  // all but the data
    if (line[0] != ':') throw EngineError(where + ": a line of Intel HEX begins with a colon");
    std::vector<uint8_t> record;
    for (size_t i = 1; i < line.size(); i += 2) {
        const int high = hex_digit(line[i]),
                  low = i + 1 < line.size() ? hex_digit(line[i + 1]) : -1;
        if (high < 0 || low < 0)
            throw EngineError(where + ": after the colon there are pairs of hexadecimal digits");
        record.push_back(static_cast<uint8_t>(high << 4 | low));
    }
    if (record.size() < RECORD_FRAME_BYTES || record.size() != RECORD_FRAME_BYTES + record[0])
        throw EngineError(where + ": the record is not as long as it says; is the file cut off?");
    uint8_t sum = 0;
    for (uint8_t byte : record) sum = static_cast<uint8_t>(sum + byte);
    if (sum != 0) throw EngineError(where + ": wrong checksum; the file is damaged");
    return record;
}

/// A structure of an ELF file, copied: offsets in a file need not be aligned.
template <typename T>
T at_offset(const std::string &content, size_t offset, const std::string &path) {
    T value;
    if (offset > content.size() || content.size() - offset < sizeof value)
        throw EngineError(path + ": the ELF file is cut off");
    std::memcpy(&value, content.data() + offset, sizeof value);
    return value;
}

}  // namespace

std::shared_ptr<const FlashImage> FlashImage::load(const std::string &path) {
    return load_together({path});
}

std::shared_ptr<const FlashImage> FlashImage::load_together(const std::vector<std::string> &paths) {
    std::shared_ptr<FlashImage> image(new FlashImage);
    for (const std::string &path : paths) image->add(path);
    image->name_ = paths.front().substr(paths.front().find_last_of('/') + 1);
    if (image->translation_ != nullptr)
        image->name_.resize(image->name_.size() - TRANSLATION_SUFFIX.size());
    if (paths.size() > 1) image->translation_ = nullptr;  // it would be of one alone
    return image;
}

std::shared_ptr<const FlashImage> FlashImage::of(const std::array<uint8_t, BYTES> &content,
                                                 const std::string &name) {
    std::shared_ptr<FlashImage> image(new FlashImage);
    image->bytes_ = content;
    image->name_ = name;
    for (size_t i = 0; i < BYTES; i++) {
        image->programmed_[i] = content[i] != atmega328p::ERASED;
        if (image->programmed_[i]) image->end_ = i + 1;
    }
    return image;
}

void FlashImage::add(const std::string &path) {
    const std::string content = content_of(path);
    const size_t end_before = std::exchange(end_, 0);
    if (content.empty()) throw EngineError(path + " is empty");
    if (path.ends_with(TRANSLATION_SUFFIX))
        read_translation(path);
    else if (content.compare(0, SELFMAG, ELFMAG) == 0)
        read_elf(path, content);
    else
        read_hex(path, content);
    if (end_ == 0) throw EngineError(path + " holds no program");
    end_ = std::max(end_, end_before);
}

std::optional<uint16_t> FlashImage::symbol(const std::string &name) const {
    auto found = symbols_.find(name);
    if (found == symbols_.end()) return std::nullopt;
    return found->second;
}

uint32_t FlashImage::boot_section() const {
    for (uint32_t start : BOOT_SECTIONS)
        if (bytes_[start] != atmega328p::ERASED) return start;
    return BOOT_SECTIONS[0];
}

/// Puts bytes of the file into flash or EEPROM, by their address. Fuses, lock bits and signature
/// are left out: those of a Kilobot hold.
void FlashImage::load_bytes(uint32_t address, const uint8_t *data, size_t count,
                            const std::string &where) {
    if (address >= FUSE_BASE) return;
    if (address < EEPROM_BASE) return program(address, data, count, where);
    const uint32_t first = address - EEPROM_BASE;
    if (first > EEPROM_BYTES || count > EEPROM_BYTES - first)
        throw EngineError(where + ": bytes at " + in_hex(first) +
                          " do not fit into the ATmega328P's EEPROM of 1 KB");
    for (size_t i = 0; i < count; i++) eeprom_[static_cast<uint16_t>(first + i)] = data[i];
}

void FlashImage::program(uint32_t address, const uint8_t *data, size_t count,
                         const std::string &where) {
    if (address > BYTES || count > BYTES - address)
        throw EngineError(where + ": bytes at " + in_hex(address) +
                          " do not fit into the ATmega328P's flash of 32 KB");
    for (size_t i = 0; i < count; i++) {
        // Two files appended to one another are no program.
        if (programmed_[address + i] && bytes_[address + i] != data[i])
            throw EngineError(where + ": the byte at " +
                              in_hex(address + static_cast<uint32_t>(i)) +
                              " was given before, as something else");
        programmed_[address + i] = true;
        bytes_[address + i] = data[i];
    }
    if (count > 0) end_ = std::max(end_, address + count);
}

/// Addresses are `base`, from the last address record, plus the 16 bits of each data record.
void FlashImage::read_hex(const std::string &path, const std::string &text) {
    std::istringstream lines(text);
    std::string line;
    uint32_t base = 0;
    bool ended = false;
    for (int number = 1; std::getline(lines, line); number++) {
        while (!line.empty() && std::strchr(" \t\r", line.back()) != nullptr) line.pop_back();
        if (line.empty()) continue;
        const std::string where = path + ":" + std::to_string(number);
        if (ended) throw EngineError(where + ": there is more after the end-of-file record");
        const auto record = record_of(line, where);
        const auto word = [&](size_t i) {
            return static_cast<uint32_t>(record[i] << 8 | record[i + 1]);
        };
        const bool is_address = record[3] == SEGMENT_ADDRESS || record[3] == LINEAR_ADDRESS;
        if (is_address && record[0] != 2)
            throw EngineError(where + ": an address record has two bytes");
        switch (record[3]) {
        case DATA: load_bytes(base + word(1), record.data() + 4, record[0], where); break;
        case END_OF_FILE: ended = true; break;
        case SEGMENT_ADDRESS: base = word(4) << 4; break;
        case LINEAR_ADDRESS: base = word(4) << 16; break;
        case SEGMENT_START:
        case LINEAR_START: break;  // an AVR starts at its reset vector
        default:
            throw EngineError(where + ": record type " + in_hex(record[3]) +
                              "; Intel HEX has 00 to 05");
        }
    }
    if (!ended)
        throw EngineError(path + ": the end-of-file record is missing; is the file cut off?");
    check_middle(path);
}

/// A program that a compiler made has no holes, but for its vectors. Above it may lie a loader of
/// the boot section, and the image record below that.
void FlashImage::check_middle(const std::string &path) const {
    constexpr ptrdiff_t LINE = 16;  // bytes that a record holds, as most tools write them
    const auto vectors_end = programmed_.begin() + VECTORS * atmega328p::VECTOR_BYTES;
    const auto end = programmed_.begin() + APPLICATION_BYTES;
    const auto hole = std::find(vectors_end, end, false), after = std::find(hole, end, true);
    if (!programmed_[0] || after == end || after - hole < LINE) return;
    throw EngineError(path + ": bytes from " +
                      in_hex(static_cast<uint32_t>(hole - programmed_.begin())) + " to " +
                      in_hex(static_cast<uint32_t>(after - programmed_.begin() - 1)) +
                      " are missing; is a piece cut out of the file?");
}

// Vectors without a handler all lead to the same place.
bool FlashImage::is_overhead_controllers() const {
    const auto jump = [this](size_t vector) {
        std::array<uint8_t, atmega328p::VECTOR_BYTES> bytes;
        std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(vector * atmega328p::VECTOR_BYTES),
                    atmega328p::VECTOR_BYTES, bytes.begin());
        return bytes;
    };
    const auto unused = jump(atmega328p::VECTOR_COMPARATOR);
    size_t alike = 0;
    for (size_t vector = 1; vector < VECTORS; vector++) alike += jump(vector) == unused;
    return alike > VECTORS / 2 && unused != jump(0) && jump(SERIAL_RECEIVE_VECTOR) != unused;
}

void FlashImage::read_elf(const std::string &path, const std::string &content) {
    if (content.size() < EI_NIDENT || content[EI_CLASS] != ELFCLASS32)
        throw EngineError(path + " is no ELF file for AVR");
    const auto header = at_offset<Elf32_Ehdr>(content, 0, path);
    if (header.e_machine != ELF_MACHINE_AVR || header.e_type != ET_EXEC)
        throw EngineError(path + " is no ELF executable for AVR: was it built by avr-gcc?");
    // Physical addresses: where the initial values of variables are flashed.
    for (size_t i = 0; i < header.e_phnum; i++) {
        const auto segment =
            at_offset<Elf32_Phdr>(content, header.e_phoff + i * sizeof(Elf32_Phdr), path);
        if (segment.p_type != PT_LOAD || segment.p_filesz == 0) continue;
        if (segment.p_offset > content.size() ||
            content.size() - segment.p_offset < segment.p_filesz)
            throw EngineError(path + ": the ELF file is cut off");
        load_bytes(segment.p_paddr,
                   reinterpret_cast<const uint8_t *>(content.data()) + segment.p_offset,
                   segment.p_filesz, path);
    }
    for (size_t i = 0; i < header.e_shnum; i++) {
        const auto table =
            at_offset<Elf32_Shdr>(content, header.e_shoff + i * sizeof(Elf32_Shdr), path);
        if (table.sh_type != SHT_SYMTAB) continue;
        // Its names lie in another section, which sh_link numbers.
        const auto strings = at_offset<Elf32_Shdr>(
            content, header.e_shoff + table.sh_link * sizeof(Elf32_Shdr), path);
        for (size_t at = 0; at + sizeof(Elf32_Sym) <= table.sh_size; at += sizeof(Elf32_Sym)) {
            const auto symbol = at_offset<Elf32_Sym>(content, table.sh_offset + at, path);
            const size_t name = size_t{strings.sh_offset} + symbol.st_name;
            if (symbol.st_name == 0 || name >= content.size()) continue;
            const uint32_t base = symbol.st_value >= SRAM_BASE ? SRAM_BASE : 0;
            symbols_.emplace(content.c_str() + name, static_cast<uint16_t>(symbol.st_value - base));
        }
    }
}

/// Takes an image from its translation.
void FlashImage::read_translation(const std::string &path) {
    translation_ = &load_translation(path);
    for (uint32_t i = 0; i < BYTES; i++)
        if (translation_->flash[i] != atmega328p::ERASED)
            program(i, translation_->flash + i, 1, path);
    for (uint32_t i = 0; i < translation_->eeprom_bytes; i++)
        eeprom_[translation_->eeprom[i][0]] = static_cast<uint8_t>(translation_->eeprom[i][1]);
}

}  // namespace kilotwin
