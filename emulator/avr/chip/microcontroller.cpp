#include "avr/chip/microcontroller.h"

#include <simavr/avr_acomp.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_flash.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_spi.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_gdb.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/errors.h"
#include "base/registers.h"
#include "robots/translated/avr_calls.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// The comparator's input and threshold: only their order matters.
constexpr uint32_t DARK_MV = 0, THRESHOLD_MV = 1000, LIGHT_MV = 2000;

constexpr uint16_t FIRST_REGISTER = 0x20, PINB = 0x23, PINC = 0x26;

/// Memory for each address that an instruction can name: simavr says that there is none behind the
/// RAM, and writes there all the same, into whatever lies behind it on the heap.
void give_all_addresses(avr_t *avr) {
    constexpr size_t ADDRESSES = 0x10000, LONGEST_ACCESS = 4;
    auto *data = static_cast<uint8_t *>(std::calloc(ADDRESSES + LONGEST_ACCESS, 1));
    if (data == nullptr) throw std::bad_alloc();
    std::memcpy(data, avr->data, avr->ramend + 1U);
    std::free(avr->data);
    avr->data = data;
}

// simavr polls level-triggered interrupts after every instruction; a Kilobot has none.
void spare_simavr_work(avr_t *avr) {
    avr_extint_set_strict_lvl_trig(avr, 0, 0);
    avr_extint_set_strict_lvl_trig(avr, 1, 0);
}

avr_int_vector_t *find_vector(avr_t *avr, uint8_t vector) {
    for (int i = 0; i < avr->interrupts.vector_count; i++)
        if (avr->interrupts.vector[i]->vector == vector) return avr->interrupts.vector[i];
    throw std::logic_error("simavr has no such interrupt");
}

}  // namespace

/// Callbacks for simavr.
struct Microcontroller::Hooks {
    static Microcontroller &of(avr_t *avr) {
        return *static_cast<Microcontroller *>(avr->custom.data);
    }

    static void log(avr_t *avr, const int, const char *format, va_list arguments) {
        if (avr == nullptr || avr->custom.data == nullptr) return;
        char text[256];
        std::vsnprintf(text, sizeof text, format, arguments);
        of(avr).note(format, text);
    }

    static void reset(avr_t *avr) {
        of(avr).core_reset_(avr);
        of(avr).reset_.number++;
        of(avr).was_reset_ = true;
    }

    // Replaces simavr's run: as many cycles, with a call of the follower after each instruction.
    static void run_followed(avr_t *avr) {
        Microcontroller &chip = of(avr);
        const uint64_t until = avr->cycle + avr->run_cycle_count;
        do {
            const uint32_t from = avr->pc;
            avr->run_cycle_count = 1;
            chip.core_run_(avr);
            const auto sp = static_cast<uint16_t>(avr->data[R_SPL] | avr->data[R_SPH] << 8);
            chip.follower_->executed(from, avr->pc, sp);
        } while (avr->cycle < until && chip.goes_on(run_followed));
    }

    // Replaces simavr's run: as many cycles, translated where that can be.
    static void run_translated(avr_t *avr) { of(avr).run_translated(); }

    // Replaces simavr's sleep, which lets the computer sleep as long as the chip.
    static void sleep(avr_t *avr, avr_cycle_count_t for_cycles) { of(avr).dozed_ = for_cycles; }

    // Replaces that of simavr's part, which SPM calls.
    static int program(avr_io_t *part, uint32_t request, void *) {
        if (request != AVR_IOCTL_FLASH_SPM) return -1;
        of(part->avr).programming_->execute();
        return 0;
    }

    static avr_cycle_count_t alarm(avr_t *, avr_cycle_count_t, void *clock) {
        auto &fired = *static_cast<Clock *>(clock);
        fired.at = NO_ALARM;
        fired.chip->board_.alarm(fired.which);
        return 0;
    }

    static void write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter) {
        const auto &watched = *static_cast<Watched *>(parameter);
        // kilolib's set_color() writes six times, mostly the value that is there: simavr's chain of
        // calls for each would be wasted.
        if (watched.watch == Watch::CHANGES && avr->data[address] == value) return;
        if (watched.chip->idle_) watched.chip->idle_->note_activity();
        if (watched.write != nullptr)
            watched.write(avr, address, value, watched.parameter);
        else
            avr->data[address] = value;
        watched.chip->board_.register_written(address);
    }

    static uint8_t read(avr_t *avr, avr_io_addr_t address, void *parameter) {
        const auto &read = *static_cast<Read *>(parameter);
        if (read.chip->idle_) read.chip->idle_->note_activity();
        return read.read(avr, address, read.parameter);
    }

    static void flag_changed(avr_irq_t *irq, uint32_t value, void *parameter) {
        const auto *chip = static_cast<Microcontroller *>(parameter);
        if (value != 0 && !chip->reviewing_) chip->board_.flag_set(static_cast<uint8_t>(irq->irq));
    }

    static void enable_written(avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter) {
        const auto &watched = *static_cast<Watched *>(parameter);
        const uint8_t before = avr->data[address], status = avr->data[UCSR0A];
        if (watched.write != nullptr)
            watched.write(avr, address, value, watched.parameter);
        else
            avr->data[address] = value;
        // simavr takes a transmitter that was not enabled for a full one.
        if (address == UCSR0B) avr->data[UCSR0A] |= status & UCSR0A_UDRE;
        // simavr stores the comparator's flag as written; on the chip a one clears it and a zero
        // leaves it alone.
        if (address == ACSR && (value & ACSR_ACI) == 0) avr->data[ACSR] |= before & ACSR_ACI;
        if (address == ACSR && (value & ACSR_ACI) != 0)
            watched.chip->clear_interrupt(VECTOR_COMPARATOR);
        watched.chip->review_interrupts(address);
    }

    static void spi_byte(avr_irq_t *, uint32_t value, void *parameter) {
        const auto *chip = static_cast<Microcontroller *>(parameter);
        if (chip->idle_) chip->idle_->note_activity();
        const uint8_t answer = chip->board_.spi_exchange(static_cast<uint8_t>(value));
        avr_raise_irq(avr_io_getirq(chip->avr_, AVR_IOCTL_SPI_GETIRQ(0), SPI_IRQ_INPUT), answer);
    }

    static void serial_byte(avr_irq_t *, uint32_t value, void *chip) {
        static_cast<Microcontroller *>(chip)->board_.serial_byte(static_cast<uint8_t>(value));
    }

    // simavr enters vectors at 0, whatever IVSEL says.
    static void interrupt_entered(avr_irq_t *, uint32_t vector, void *parameter) {
        const auto *chip = static_cast<Microcontroller *>(parameter);
        avr_t *avr = chip->avr_;
        if ((avr->data[MCUCR] & MCUCR_IVSEL) != 0 && vector != 0 &&
            avr->pc == vector * VECTOR_BYTES)
            avr->pc += chip->boot_section_;
    }

    // Puts `write` in place of simavr's own function for a register, which it has to call.
    static void replace_write(Microcontroller &chip, uint16_t address, avr_io_write_t write) {
        auto &handler = chip.avr_->io[AVR_DATA_TO_IO(address)].w;
        chip.watched_.push_back({&chip, Watch::WRITES, handler.c, handler.param});
        handler.c = write;
        handler.param = &chip.watched_.back();
    }

    static void exchange_spi(avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter) {
        const auto &watched = *static_cast<Watched *>(parameter);
        watched.write(avr, address, value, watched.parameter);
        watched.chip->set_spi_time();
    }

    static void send_serial(avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter) {
        const auto &watched = *static_cast<Watched *>(parameter);
        watched.chip->set_serial_rate();
        watched.write(avr, address, value, watched.parameter);
    }
};

Microcontroller::Microcontroller(Board &board, const FlashImage &flash, const EepromImage &eeprom)
    : board_(board),
      boot_section_(flash.boot_section()) {
    avr_global_logger_set(Hooks::log);
    avr_ = avr_make_mcu_by_name("atmega328p");
    if (avr_ == nullptr) throw EngineError("this simavr does not know the ATmega328P");
    avr_init(avr_);
    give_all_addresses(avr_);
    avr_->custom.data = this;
    avr_->frequency = CYCLES_PER_SECOND;
    // Else simavr runs on behind an instruction that sets a timer, up to that timer.
    avr_->run_cycle_limit = 1;
    avr_->sleep = Hooks::sleep;
    core_reset_ = avr_->reset;
    avr_->reset = Hooks::reset;
    spare_simavr_work(avr_);
    auto code = flash.bytes();
    avr_loadcode(avr_, code.data(), static_cast<uint32_t>(code.size()), 0);
    programming_ = std::make_unique<SelfProgramming>(avr_, boot_section_);
    for (avr_io_t *part = avr_->io_port; part != nullptr; part = part->next)
        if (std::strcmp(part->kind, "flash") == 0) part->ioctl = Hooks::program;
    avr_->data[MCUSR] = MCUSR_PORF;
    auto bytes = eeprom;
    for (const auto &[address, byte] : flash.eeprom()) bytes[address] = byte;
    avr_eeprom_desc_t content = {bytes.data(), 0, static_cast<uint32_t>(bytes.size())};
    avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &content);
    // No echo of the UART on the emulator's own output.
    uint32_t quiet = 0;
    avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS('0'), &quiet);
    avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            Hooks::serial_byte, this);
    avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_SPI_GETIRQ(0), SPI_IRQ_OUTPUT),
                            Hooks::spi_byte, this);
    avr_irq_register_notify(avr_->interrupts.irq + AVR_INT_IRQ_RUNNING, Hooks::interrupt_entered,
                            this);
    avr_raise_irq(avr_io_getirq(avr_, AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN1), THRESHOLD_MV);
    set_comparator(false);
    for (uint8_t i = 0; i < ALARMS; i++) clocks_[i] = {this, static_cast<Alarm>(i)};
    watch_reads();
    for (int i = 0; i < avr_->interrupts.vector_count; i++)
        watch_enables(avr_->interrupts.vector[i]->enable.reg);
    Hooks::replace_write(*this, UDR0, Hooks::send_serial);
    Hooks::replace_write(*this, SPDR, Hooks::exchange_spi);
    idle_ = std::make_unique<IdleLoop>(avr_);
    core_run_ = avr_->run;
    if (flash.translation() == nullptr) return;
    translated_ = std::make_unique<TranslatedCore>(avr_, *flash.translation());
    avr_->run = Hooks::run_translated;
}

/// Reads of counters and flags, which change by themselves, count as activity: such a loop must be
/// executed. Pins change only by set_pin(), which ends the idling itself.
void Microcontroller::watch_reads() {
    for (uint16_t address = FIRST_REGISTER; address < MAX_IOs; address++) {
        auto &handler = avr_->io[AVR_DATA_TO_IO(address)].r;
        if (handler.c == nullptr || address == PINB || address == PINC || address == PIND) continue;
        reads_.push_back({this, handler.c, handler.param});
        handler.c = Hooks::read;
        handler.param = &reads_.back();
    }
}

/// simavr looks at an interrupt's enable bit only when its flag goes up; a write to the enable bit
/// afterwards is made up for here.
void Microcontroller::watch_enables(uint16_t address) {
    if (address < FIRST_REGISTER) return;
    auto &handler = avr_->io[AVR_DATA_TO_IO(address)].w;
    if (handler.c == Hooks::enable_written) return;
    watched_.push_back({this, Watch::WRITES, handler.c, handler.param});
    handler.c = Hooks::enable_written;
    handler.param = &watched_.back();
}

void Microcontroller::review_interrupts(uint16_t address) {
    reviewing_ = true;
    for (int i = 0; i < avr_->interrupts.vector_count; i++) {
        avr_int_vector_t *vector = avr_->interrupts.vector[i];
        if (vector->enable.reg != address || vector->raised.reg == 0) continue;
        const bool enabled = avr_regbit_get(avr_, vector->enable) != 0;
        const bool raised = avr_regbit_get(avr_, vector->raised) != 0;
        if (enabled && raised && !vector->pending) avr_raise_interrupt(avr_, vector);
        if (enabled || !vector->pending) continue;
        avr_clear_interrupt(avr_, vector);
        if (raised) avr_regbit_set(avr_, vector->raised);
    }
    reviewing_ = false;
}

Microcontroller::~Microcontroller() {
    avr_terminate(avr_);
    std::free(avr_);
}

uint64_t Microcontroller::cycle() const { return avr_->cycle; }

uint64_t Microcontroller::rests_until() const {
    if (!failure_.empty()) return NO_ALARM;
    const uint64_t end = idle_ ? idle_->end() : 0;
    return end == 0 || end == NO_ALARM ? end : end - 1;
}

void Microcontroller::run(uint64_t until) {
    while (avr_->cycle < until && failure_.empty()) {
        // Should the watchdog reset it next, these are 0 when that is noticed.
        if (!was_reset_) {
            reset_.pc = avr_->pc;
            reset_.control = avr_->data[WDTCSR];
        }
        if (idle_ && idle_->pass(until)) return;
        if (idle_ && idle_->fell_asleep()) {
            sleep(until);
            continue;
        }
        if (avr_->cycle >= until) return;
        const auto *timer = avr_->cycle_timers.timer;
        const uint64_t stop = timer != nullptr ? std::min<uint64_t>(timer->when, until) : until;
        // simavr checks gdb's breakpoints each time it is called.
        const bool at_once = stop > avr_->cycle && avr_->gdb == nullptr;
        avr_->run_cycle_count = at_once ? stop - avr_->cycle : 1;
        const int state = avr_run(avr_);
        if (idle_) idle_->forget();
        if (state == cpu_Running && !crashed_ && !was_reset_) continue;
        if (state == cpu_Sleeping)
            sleep(until);
        else
            recover(state);
    }
}

void Microcontroller::follow(Follower &follower) {
    skip_nothing();
    follower_ = &follower;
    avr_->run = Hooks::run_followed;
}

/// Whether the chip can execute a further instruction, as far as nothing is to be done before.
/// simavr's watchdog resets the chip by a function that takes the place of `run`.
bool Microcontroller::goes_on(void (*own_run)(avr_t *)) const {
    return avr_->state == cpu_Running && avr_->run == own_run && !crashed_ && !was_reset_ &&
           failure_.empty();
}

/// As simavr's own run: timers and interrupts are looked at behind each instruction that may have
/// set them, and behind the last.
void Microcontroller::run_translated() {
    // One instruction, or none: the chip sleeps.
    if (avr_->run_cycle_count <= 1 || avr_->state != cpu_Running) return core_run_(avr_);
    const uint64_t until = avr_->cycle + avr_->run_cycle_count;
    do {
        if (flash_seen_ != programming_->changes()) {
            flash_seen_ = programming_->changes();
            translated_->compare_flash();
        }
        const auto *timer = avr_->cycle_timers.timer;
        const uint64_t stop = timer != nullptr ? std::min<uint64_t>(timer->when, until) : until;
        const bool may_run = avr_->interrupt_state == 0 && stop > avr_->cycle;
        avr_->run_cycle_count = may_run ? translated_->run(stop) : 1;
        if (avr_->run_cycle_count != 0) {
            core_run_(avr_);
        } else {
            avr_cycle_timer_process(avr_);
            if (avr_->interrupt_state != 0) avr_service_interrupts(avr_);
        }
    } while (avr_->cycle < until && goes_on(Hooks::run_translated));
}

bool Microcontroller::wakes_from_power_down(const void *timer_owner) const {
    for (const avr_io_t *part = avr_->io_port; part != nullptr; part = part->next)
        if (part == timer_owner) return std::strcmp(part->kind, "watchdog") == 0;
    return timer_owner >= clocks_.data() && timer_owner < clocks_.data() + clocks_.size();
}

/// Sleeps until something wakes the chip. For simavr all sleep is idle, in which timers run on and
/// wake; in the other modes only the watchdog and the world outside go on. Without a clock the
/// comparator misses edges.
void Microcontroller::sleep(uint64_t until) {
    // simavr spends a cycle on each call for a chip that sleeps; taken back, or its timers come
    // early.
    avr_->cycle -= dozed_ + 1;
    // simavr wakes a chip by an interrupt that comes in its sleep, not by one that waits already.
    if (!asleep_ && avr_has_pending_interrupts(avr_) != 0) {
        avr_->state = cpu_Running;
        return;
    }
    const uint8_t mode = avr_->data[SMCR] & SMCR_SM;
    const bool deeply = mode != SLEEP_IDLE;
    if (mode == SLEEP_NOISE_REDUCTION && !asleep_) board_.quiet_sleep();
    asleep_ = deeply;
    while (avr_->state == cpu_Sleeping && avr_->cycle < until) {
        uint64_t wake = until;
        for (auto *slot = avr_->cycle_timers.timer; slot != nullptr; slot = slot->next)
            if (!deeply || wakes_from_power_down(slot->param))
                wake = std::min<uint64_t>(wake, slot->when);
        const uint64_t slept = wake > avr_->cycle ? wake - avr_->cycle : 0;
        if (deeply) postpone_timers(slept);
        avr_->cycle += slept;
        avr_cycle_timer_process(avr_);
    }
    if (avr_->state == cpu_Sleeping) return;
    asleep_ = false;
    set_comparator(light_);
}

/// Moves the timers that stand still in power-down by the time that it lasted.
void Microcontroller::postpone_timers(uint64_t cycles) {
    std::vector<avr_cycle_timer_slot_t *> slots;
    for (auto *slot = avr_->cycle_timers.timer; slot != nullptr; slot = slot->next) {
        slots.push_back(slot);
        if (!wakes_from_power_down(slot->param)) slot->when += cycles;
    }
    std::stable_sort(slots.begin(), slots.end(),
                     [](const auto *a, const auto *b) { return a->when < b->when; });
    for (size_t i = 0; i < slots.size(); i++)
        slots[i]->next = i + 1 < slots.size() ? slots[i + 1] : nullptr;
    avr_->cycle_timers.timer = slots.empty() ? nullptr : slots.front();
    for (avr_io_t *part = avr_->io_port; part != nullptr; part = part->next)
        if (std::strcmp(part->kind, "timer") == 0)
            reinterpret_cast<avr_timer_t *>(part)->tov_base += cycles;
}

/// Handles a run that ended neither regularly nor in sleep.
void Microcontroller::recover(int state) {
    if (was_reset_) {
        // A reset clears all of simavr's timers, and the level at the comparator.
        was_reset_ = false;
        programming_->was_reset();
        for (auto &clock : clocks_) arm(clock);
        board_.was_reset(reset_);
    }
    if (crashed_ && failure_.empty()) {
        // The chip's program counter has 14 bits, and kilolib jumps into the boot section by its
        // wrap.
        crashed_ = false;
        avr_->pc = crashed_at_ % FLASH_BYTES;
        avr_->state = cpu_Running;
    }
    if (state == cpu_Done && failure_.empty())
        fail("it sleeps with interrupts off, so nothing can wake it");
}

/// Derives the failure from simavr's log, the only place where it reports the reason.
void Microcontroller::note(const char *format, const char *text) {
    if (crashed_ || !failure_.empty()) return;
    char what[128];
    if (std::strstr(format, "Invalid Opcode") != nullptr) {
        std::snprintf(what, sizeof what, "bad opcode 0x%02X%02X at PC 0x%04X",
                      avr_->flash[avr_->pc + 1], avr_->flash[avr_->pc], avr_->pc);
        fail(what);
    } else if (const char *address = std::strstr(text, "Address "); address != nullptr) {
        const bool reads = std::strstr(format, "Invalid read") != nullptr;
        std::snprintf(what, sizeof what,
                      "it %s address 0x%.4s, where there is no memory, at PC 0x%04X",
                      reads ? "reads" : "writes to", address + std::strlen("Address "), avr_->pc);
        fail(what);
    } else if (std::strstr(text, "avr_sadly_crashed") != nullptr) {
        crashed_ = true;
        crashed_at_ = avr_->pc;
    }
}

void Microcontroller::fail(std::string why) {
    failure_ = std::move(why);
    failure_code_ = avr_code_path(avr_->pc, avr_->data, avr_->flash);
}

uint8_t Microcontroller::read(uint16_t address) const { return avr_->data[address]; }
bool Microcontroller::carry() const { return avr_->sreg[S_C] != 0; }
void Microcontroller::write(uint16_t address, uint8_t value) {
    avr_->data[address] = value;
    if (idle_) idle_->forget();
}

uint8_t Microcontroller::flash(uint16_t address) const { return programming_->content(address); }

void Microcontroller::start_at_boot_section() {
    avr_->reset_pc = boot_section_;
    avr_->pc = boot_section_;
}

void Microcontroller::watch_register(uint16_t address, Watch watch) {
    auto &handler = avr_->io[AVR_DATA_TO_IO(address)].w;
    watched_.push_back({this, watch, handler.c, handler.param});
    handler.c = Hooks::write;
    handler.param = &watched_.back();
    if (translated_) translated_->find_effects();
}

void Microcontroller::watch_interrupt(uint8_t vector) {
    avr_irq_t *irq = find_vector(avr_, vector)->irq + AVR_INT_IRQ_PENDING;
    irq->irq = vector;
    avr_irq_register_notify(irq, Hooks::flag_changed, this);
}

void Microcontroller::take_over(uint16_t address) {
    avr_->io[AVR_DATA_TO_IO(address)].r = {};
    auto &handler = avr_->io[AVR_DATA_TO_IO(address)].w;
    const bool enables = handler.c == Hooks::enable_written;
    handler = {};
    if (enables) watch_enables(address);
    if (translated_) translated_->find_effects();
}

void Microcontroller::raise_interrupt(uint8_t vector) {
    avr_raise_interrupt(avr_, find_vector(avr_, vector));
}

void Microcontroller::clear_interrupt(uint8_t vector) {
    avr_clear_interrupt(avr_, find_vector(avr_, vector));
}

void Microcontroller::set_alarm(Alarm alarm, uint64_t at) {
    clocks_[alarm].at = at;
    arm(clocks_[alarm]);
}

/// Sets simavr's timer of an alarm clock; a moment that has passed is due with the next
/// instruction.
void Microcontroller::arm(Clock &clock) {
    avr_cycle_timer_cancel(avr_, Hooks::alarm, &clock);
    if (clock.at == NO_ALARM) return;
    const uint64_t away = clock.at > avr_->cycle ? clock.at - avr_->cycle : 1;
    avr_cycle_timer_register(avr_, away, Hooks::alarm, &clock);
}

void Microcontroller::set_comparator(bool light) {
    light_ = light;
    if (asleep_) return;
    avr_raise_irq(avr_io_getirq(avr_, AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN0),
                  light ? LIGHT_MV : DARK_MV);
}

/// A byte on the SPI takes 100 us in simavr; here what the registers give.
void Microcontroller::set_spi_time() {
    constexpr uint8_t RATE = 3, DOUBLE_SPEED = 1 << 0;
    constexpr std::array<uint64_t, 4> CYCLES_PER_BIT = {4, 16, 64, 128};
    const uint64_t cycles = 8 * CYCLES_PER_BIT[avr_->data[SPCR] & RATE] /
                            ((avr_->data[SPSR] & DOUBLE_SPEED) != 0 ? 2 : 1);
    const avr_io_t *part = avr_->io_port;
    while (part != nullptr && std::strcmp(part->kind, "spi") != 0) part = part->next;
    auto *slot = avr_->cycle_timers.timer;
    while (slot != nullptr && slot->param != part) slot = slot->next;
    if (slot == nullptr) return;  // the SPI is off
    const auto timer = slot->timer;
    void *const parameter = slot->param;
    avr_cycle_timer_cancel(avr_, timer, parameter);
    avr_cycle_timer_register(avr_, cycles, timer, parameter);
}

/// simavr counts a parity bit in every byte, which makes the UART too slow: set to what the
/// registers give.
void Microcontroller::set_serial_rate() {
    constexpr uint8_t DOUBLE_SPEED = 1 << 1, PARITY = 1 << 5, TWO_STOP_BITS = 1 << 3, SIZE = 3 << 1;
    const uint8_t format = avr_->data[UCSR0C];
    const unsigned size = 5 + ((format & SIZE) >> 1);
    const unsigned bits = 1 + size + ((format & PARITY) != 0) + 1 + ((format & TWO_STOP_BITS) != 0);
    const unsigned divider = 1 + (avr_->data[UBRR0L] | (avr_->data[UBRR0H] & 15u) << 8);
    const unsigned cycles = (avr_->data[UCSR0A] & DOUBLE_SPEED) != 0 ? 8 : 16;
    for (avr_io_t *part = avr_->io_port; part != nullptr; part = part->next)
        if (std::strcmp(part->kind, "uart") == 0)
            reinterpret_cast<avr_uart_t *>(part)->cycles_per_byte = divider * cycles * bits;
}

void Microcontroller::set_pin(char port, uint8_t pin, bool high) {
    if (idle_) idle_->forget();
    avr_raise_irq(avr_io_getirq(avr_, static_cast<uint32_t>(AVR_IOCTL_IOPORT_GETIRQ(port)), pin),
                  high);
}

EepromImage Microcontroller::eeprom() const {
    EepromImage bytes;
    avr_eeprom_desc_t content = {bytes.data(), 0, static_cast<uint32_t>(bytes.size())};
    avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &content);
    return bytes;
}

void Microcontroller::listen_for_debugger(uint16_t port) {
    const auto run = avr_->run;
    const auto sleep = avr_->sleep;
    avr_->gdb_port = port;
    if (avr_gdb_init(avr_) < 0 || avr_->gdb == nullptr)
        throw EngineError("gdb cannot be served on port " + std::to_string(port) +
                          ": is it taken?");
    debugger_ = std::exchange(avr_->gdb, nullptr);
    avr_->gdb_port = 0;  // simavr would serve a chip that crashes
    avr_->run = run;
    avr_->sleep = sleep;
}

void Microcontroller::serve_debugger() {
    avr_->gdb = debugger_;
    avr_->run = avr_callback_run_gdb;
    avr_->sleep = Hooks::sleep;
    avr_->state = cpu_Stopped;
}

}  // namespace kilotwin
