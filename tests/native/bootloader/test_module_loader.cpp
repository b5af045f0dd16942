// The modules' boot loader on its chip: entered by our runtime, fed by CAN, its flash rewritten.
#include <doctest/doctest.h>

#include <cstdlib>

#include "module.h"

using namespace kilotwin;

namespace {

constexpr uint8_t IDENTITY = 0xE0;
enum : uint8_t { NOTHING, LOADING, COMPLETE, WRONG };

const Image &sites() {
    static const Image image(SITES);
    return image;
}

const Image &newer() {
    static const Image image(PROGRAMS "/module.elf");
    return image;
}

/// The state of sites, which is what a module of our runtime begins its variable with.
uint8_t state_of_sites(const FlashedModule &module) {
    static const auto address = FlashImage::load(SITES)->symbol("runtime_orders");
    REQUIRE(address);
    return module.board.read(*address);
}

bool waits_in_loader(FlashedModule &module) {
    const auto answer = module.ask(IDENTITY);
    return answer && (*answer)[0] == BOOT_REPORT;
}

/// As a dispatcher or an original host (hardware.md 3.7): one lap of frames 1 ms apart.
void send_as_published(FlashedModule &module, const Image &image, uint8_t older_by,
                       Cycles spacing = MS) {
    module.announce(image, false, older_by);
    for (uint8_t page = 0; page < image.pages(); page++)
        module.send_page(image, page, spacing, older_by);
}

/// A sender of ours: an announcement with a check, then what the module says is missing, until it
/// has all. Returns the laps.
int send_as_ours(FlashedModule &module, const Image &image, Cycles spacing, int most_laps) {
    for (int lap = 1; lap <= most_laps; lap++) {
        module.announce(image, true);
        for (uint8_t first = 0; first < image.pages(); first = static_cast<uint8_t>(first + 32)) {
            const auto answer = module.ask(first);
            for (uint8_t i = 0; answer && i < 32; i++)
                if (((*answer)[2 + i / 8u] >> i % 8 & 1) != 0)
                    module.send_page(image, static_cast<uint8_t>(first + i), spacing);
        }
        module.run_ms(1000);
        const auto answer = module.ask(IDENTITY);
        if (answer && (*answer)[6] == COMPLETE) return lap;
    }
    return most_laps + 1;
}

std::function<bool()> every_nth_of_chance_is_lost(uint32_t n) {
    return [n, seed = uint32_t{7}]() mutable {
        seed = seed * 1664525u + 1013904223u;
        return (seed >> 16) % n == 0;
    };
}

}  // namespace

TEST_CASE("a loader alone waits, blinks blue as published, and answers to its own identifier") {
    FlashedModule module(FlashImage::load(LOADER)->bytes());
    module.run_ms(50);
    const auto answer = module.ask(IDENTITY);
    REQUIRE(answer);
    CHECK((*answer)[0] == BOOT_REPORT);
    CHECK((*answer)[1] == IDENTITY);
    CHECK((*answer)[6] == NOTHING);
    CHECK(module.ask(0, ALL));
    CHECK(module.ask(0, ROW));
    CHECK(module.ask(0, COLUMN));
    CHECK_FALSE(module.ask(0, OWN + 2));
    std::vector<Cycles> changes;
    bool lit = false;
    for (int i = 0; i < 1000; i++) {
        module.run_ms(2);
        const uint8_t color = module.board.light(i % 4u).color();
        CHECK((color == 0 || color == BLUE));
        if ((color == BLUE) != lit) changes.push_back(module.board.now());
        lit = color == BLUE;
    }
    REQUIRE(changes.size() >= 9);
    // The first one is where the test began to look.
    for (size_t i = 2; i < changes.size(); i++)
        CHECK(std::abs(double(changes[i] - changes[i - 1]) / double(MS) - 200) < 8);
    CHECK(module.board.failure() == "");
}

TEST_CASE("a module without a place takes broadcasts and does not answer") {
    FlashedModule module(FlashImage::load(LOADER)->bytes(), 0xFF, 0xFF);
    module.run_ms(50);
    CHECK_FALSE(module.ask(0, ALL));
    CHECK(module.sent.empty());
    send_as_published(module, newer(), 0);
    module.run_ms(500);
    CHECK(module.says() == 'N');
}

TEST_CASE("a stored program starts at power-up, and MODULE_BOOT calls the loader from it") {
    for (bool with_record : {true, false}) {
        FlashedModule module(with_record ? flash_with_record(sites()) : flash_of(SITES));
        module.run_ms(1500);
        CHECK(module.board.failure() == "");
        CHECK(state_of_sites(module) == STATE_IDLE);
        CHECK_FALSE(waits_in_loader(module));
        module.send(MODULE_BOOT, {});
        module.run_ms(20);
        CHECK(waits_in_loader(module));
        // Nothing was erased: each order starts it again.
        for (int order :
             {int{MODULE_IDLE}, int{MODULE_SETUP}, int{MODULE_RUN}, MODULE_IDLE + OLDER}) {
            module.announce(newer(), true);
            module.send(static_cast<uint8_t>(order), {});
            module.run_ms(1500);
            CHECK(state_of_sites(module) == STATE_IDLE);
            CHECK_FALSE(waits_in_loader(module));
            module.send(MODULE_BOOT, {});
            module.run_ms(20);
            CHECK(waits_in_loader(module));
        }
        CHECK(module.board.flash_operations() == 0);
        CHECK(module.board.failure() == "");
    }
}

TEST_CASE("the loader is entered from a running module, whose lights and cells it takes over") {
    FlashedModule module(flash_with_record(sites()));
    module.run_ms(1500);
    module.send(MODULE_SETUP, {});
    module.send(MODULE_RUN, {});
    module.run_ms(1000);
    CHECK(state_of_sites(module) == STATE_RUNNING);
    module.send(MODULE_BOOT, {});
    module.run_ms(20);
    module.board.lights.clear();
    CHECK(waits_in_loader(module));
    module.run_ms(1000);
    CHECK(module.board.lights.empty());
}

TEST_CASE("one lap of frames 1 ms apart, as published, replaces a program and starts the new one") {
    for (uint8_t older_by : {uint8_t{0}, uint8_t{OLDER}}) {
        FlashedModule module(flash_with_record(sites()));
        module.run_ms(1500);
        module.send(MODULE_BOOT, {});
        module.run_ms(3);
        send_as_published(module, newer(), older_by);
        module.run_ms(1000);
        CHECK(module.says() == 'N');
        CHECK(module.has(newer()));
        CHECK(module.board.frames_missed() == 0);
        CHECK(module.board.failure() == "");
    }
}

TEST_CASE("one lap of a long program over a long one, also at twice the published speed") {
    // As long as sites, and another program in every page.
    Image longest = sites();
    for (size_t i = 256; i < longest.bytes.size(); i++) longest.bytes[i] ^= 0x55;
    for (Cycles spacing : {MS, MS / 2}) {
        FlashedModule module(flash_with_record(sites()));
        module.run_ms(1500);
        module.send(MODULE_BOOT, {});
        module.run_ms(3);
        send_as_published(module, longest, 0, spacing);
        module.run_ms(1000);
        CHECK(module.board.frames_missed() == 0);
        CHECK(module.has(longest));
    }
}

TEST_CASE("a blank module gets sites as published, and it runs") {
    FlashedModule module(FlashImage::load(LOADER)->bytes());
    module.run_ms(50);
    send_as_published(module, sites(), 0);
    module.run_ms(2500);
    CHECK(module.has(sites()));
    CHECK(state_of_sites(module) == STATE_IDLE);
    // It starts at power-up, too.
    FlashedModule again(module.board.flash_content());
    again.run_ms(1500);
    CHECK(state_of_sites(again) == STATE_IDLE);
}

TEST_CASE("a sender of ours stores a program in a lap, and an order starts it") {
    FlashedModule module(flash_with_record(sites()));
    module.run_ms(1500);
    module.send(MODULE_BOOT, {});
    module.run_ms(10);
    CHECK(send_as_ours(module, newer(), MS * 6 / 10, 3) == 1);
    CHECK(module.board.frames_missed() == 0);
    const auto answer = module.ask(IDENTITY);
    REQUIRE(answer);
    CHECK(std::equal(newer().id.begin(), newer().id.end(), answer->begin() + 2));
    CHECK((*answer)[6] == COMPLETE);
    CHECK((*answer)[7] == newer().id[0]);
    CHECK(module.board.light(1).color() == GREEN);
    CHECK(module.says() == '\0');
    module.send(MODULE_IDLE, {});
    CHECK(module.says() == 'N');
    CHECK(module.has(newer()));
}

TEST_CASE("frames that are lost are made up for by what the module says is missing") {
    FlashedModule module(flash_with_record(sites()));
    module.run_ms(1500);
    module.send(MODULE_BOOT, {});
    module.run_ms(10);
    module.is_lost = every_nth_of_chance_is_lost(20);
    const int laps = send_as_ours(module, newer(), MS, 20);
    MESSAGE("laps: ", laps);
    CHECK(laps <= 12);
    module.is_lost = [] { return false; };
    module.send(MODULE_RUN, {});
    CHECK(module.says() == 'N');
    CHECK(module.has(newer()));
}

TEST_CASE("a page whose CRC differs comes again") {
    FlashedModule module(FlashImage::load(LOADER)->bytes());
    module.run_ms(50);
    Image damaged = newer();
    damaged.bytes[5 * 128 + 70] ^= 0x10;
    module.announce(newer(), true);
    for (uint8_t page = 0; page < newer().pages(); page++) module.send_page(damaged, page);
    module.run_ms(300);
    auto answer = module.ask(0);
    REQUIRE(answer);
    CHECK((*answer)[6] == WRONG);
    for (uint8_t page = 0; page < newer().pages(); page = static_cast<uint8_t>(page + 3)) {
        std::vector<uint8_t> data = {page};
        for (uint8_t i = page; i < page + 3; i++) {
            const uint16_t crc = i < newer().pages() ? newer().page_crc(i) : 0;
            data.push_back(static_cast<uint8_t>(crc));
            data.push_back(static_cast<uint8_t>(crc >> 8));
        }
        module.send(BOOTPAGE_CRC, data, 8 * MS);
    }
    answer = module.ask(0);
    REQUIRE(answer);
    CHECK((*answer)[2] == 1 << 5);
    CHECK((*answer)[6] == LOADING);
    module.send_page(newer(), 5);
    module.run_ms(300);
    answer = module.ask(0);
    REQUIRE(answer);
    CHECK((*answer)[6] == COMPLETE);
}

TEST_CASE("an answer that the bus keeps waiting goes out all the same, and so does the next one") {
    FlashedModule module(FlashImage::load(LOADER)->bytes(), X, Y, 100 * MS);
    module.run_ms(50);
    module.send(BOOT_QUERY, {0});
    module.run_ms(20);
    module.send(BOOT_QUERY, {32});
    module.run_ms(300);
    REQUIRE(module.sent.size() == 2);
    CHECK(module.sent[0].frame.data[1] == 0);
    CHECK(module.sent[1].frame.data[1] == 32);
}

// The power goes after each erase and write of page or record.
TEST_CASE(
    "a power cut after any flash operation leaves the old program, the new one or the loader") {
    for (bool checked : {false, true}) {
        FlashedModule victim(flash_with_record(sites()));
        victim.run_ms(1500);
        victim.send(MODULE_BOOT, {});
        victim.run_ms(10);
        uint32_t seen = 0, cuts = 0, news = 0;
        victim.watch = [&] {
            const auto operations = victim.board.flash_operations();
            if (operations == seen) return;
            CHECK(operations == seen + 1);
            seen = operations;
            cuts++;
            FlashedModule after(victim.board.flash_content());
            after.run_ms(30);
            if (after.says() == 'N') {
                news++;
                CHECK(after.has(newer()));
                return;
            }
            CHECK(waits_in_loader(after));
            if (std::getenv("KILOTWIN_LONG") == nullptr && cuts % 16 != 1) return;
            send_as_published(after, newer(), 0);
            after.run_ms(1000);
            CHECK(after.says() == 'N');
            CHECK(after.has(newer()));
        };
        if (checked)
            CHECK(send_as_ours(victim, newer(), MS, 1) == 1);
        else
            send_as_published(victim, newer(), 0);
        victim.run_ms(1000);
        MESSAGE("power cuts: ", cuts);
        CHECK(news == 1);
        CHECK(cuts >= uint32_t{newer().pages()} + sites().pages());
    }
}
