// Files that are flashed: what is read, and what is refused with a word to the user.
#include <doctest/doctest.h>

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "avr/chip/flash_image.h"
#include "base/errors.h"

using namespace kilotwin;

namespace test_flash_image {

namespace {

/// A file of its own with this content, gone at the end.
struct TemporaryFile {
    explicit TemporaryFile(const std::string &content) {
        path = std::filesystem::temp_directory_path() / "kilotwin-test-XXXXXX";
        close(mkstemp(path.data()));
        std::ofstream(path, std::ios::binary) << content;
    }
    ~TemporaryFile() { std::remove(path.c_str()); }
    std::string path;
};

/// The error of loading, without the file's name.
std::string refusal(const std::string &content) {
    TemporaryFile file(content);
    try {
        FlashImage::load(file.path);
    } catch (const EngineError &error) {
        std::string text = error.what();
        REQUIRE(text.rfind(file.path, 0) == 0);
        return text.substr(file.path.size());
    }
    return "";
}

const std::string END = ":00000001FF\n";

}  // namespace

TEST_CASE("a hex file puts its bytes where it says and leaves the rest erased") {
    TemporaryFile file(":020010001234A8\r\n\n:020000020100FB\n:01000000AB54\n" + END);
    auto image = FlashImage::load(file.path);
    CHECK(image->bytes()[0x0F] == 0xFF);
    CHECK(image->bytes()[0x10] == 0x12);
    CHECK(image->bytes()[0x11] == 0x34);
    CHECK(image->bytes()[0x1000] == 0xAB);
    CHECK(image->end() == 0x1001);
}

TEST_CASE("a hex file and the elf file of the same program are the same image") {
    auto hex = FlashImage::load(PROGRAMS "/boot.hex"), elf = FlashImage::load(PROGRAMS "/boot.elf");
    CHECK(hex->bytes() == elf->bytes());
    CHECK(hex->end() > 0x7000);
    CHECK(hex->end() == elf->end());
    CHECK(elf->symbol("boot_interrupts"));
    CHECK_FALSE(elf->symbol("no_such_name"));
    CHECK_FALSE(hex->symbol("boot_interrupts"));
    CHECK(hex->name() == "boot.hex");
}

TEST_CASE("a damaged hex file is refused with its line") {
    CHECK(refusal("hello\n") == ":1: a line of Intel HEX begins with a colon");
    CHECK(refusal(":020010001234A9\n" + END) == ":1: wrong checksum; the file is damaged");
    CHECK(refusal(":02001000123\n" + END) ==
          ":1: after the colon there are pairs of hexadecimal digits");
    CHECK(refusal(":0200100012\n" + END) ==
          ":1: the record is not as long as it says; is the file cut off?");
    CHECK(refusal(":020010001234A8\n") ==
          ": the end-of-file record is missing; is the file cut off?");
    CHECK(refusal(END + END) == ":2: there is more after the end-of-file record");
    CHECK(refusal(":0000000AF6\n" + END) == ":1: record type 0xA; Intel HEX has 00 to 05");
    CHECK(refusal(":020010001234A8\n:0100100013DC\n" + END) ==
          ":2: the byte at 0x10 was given before, as something else");
    CHECK(refusal(END) == " holds no program");
    CHECK(refusal("") == " is empty");
}

TEST_CASE("a program that does not fit is refused") {
    CHECK(refusal(":027FFF0001027D\n" + END) ==
          ":1: bytes at 0x7FFF do not fit into the ATmega328P's flash of 32 KB");
    CHECK(refusal(":020000040001F9\n:0100000001FE\n" + END) ==
          ":2: bytes at 0x10000 do not fit into the ATmega328P's flash of 32 KB");
}

TEST_CASE("an EEPROM section is kept apart, and fuses are left as they are") {
    // As objcopy writes them when it is not told to leave them out.
    const std::string whole =
        ":020010001234A8\n:02000004008179\n:010005006397\n:02000004008278\n:01000000D926\n";
    TemporaryFile with_eeprom(whole + END);
    auto image = FlashImage::load(with_eeprom.path);
    CHECK(image->eeprom() == std::map<uint16_t, uint8_t>{{5, 0x63}});
    CHECK(image->end() == 0x12);
    CHECK(refusal(":02000004008179\n:0203FF000102F9\n" + END) ==
          ":2: bytes at 0x3FF do not fit into the ATmega328P's EEPROM of 1 KB");
    CHECK(refusal(":02000004008179\n:010005006397\n" + END) == " holds no program");
}

TEST_CASE("a file that is no AVR program is refused") {
    CHECK(refusal("\177ELF") == " is no ELF file for AVR");
    std::ifstream host("/proc/self/exe", std::ios::binary);
    std::string content(4096, '\0');
    host.read(content.data(), static_cast<std::streamsize>(content.size()));
    CHECK(refusal(content) == " is no ELF file for AVR");
    std::ifstream elf(PROGRAMS "/outputs.elf", std::ios::binary);
    content.assign(std::istreambuf_iterator<char>(elf), {});
    CHECK(refusal(content.substr(0, 200)) == ": the ELF file is cut off");
    CHECK_THROWS_WITH_AS(FlashImage::load("/no/such/file.hex"), "/no/such/file.hex cannot be read",
                         EngineError);
}

}  // namespace test_flash_image
