// A program in the boot section that programs the flash in ways that differ from one another, and
// keeps what it reads afterwards.
#include <avr/boot.h>
#include <avr/io.h>
#include <avr/pgmspace.h>

volatile uint16_t both_writes, first_fill, unwritten_word, from_below, too_late;
volatile uint16_t while_busy, while_not_enabled, after_enable;
volatile uint16_t erase_cycles, write_cycles;
volatile uint8_t busy_bits, idle_bits, done;

static uint16_t finish(void) {
    TCNT1 = 0;
    while (boot_spm_busy()) {
    }
    const uint16_t cycles = TCNT1;
    boot_rww_enable();
    return cycles;
}

static void write(uint16_t page, uint16_t first, uint16_t second) {
    boot_page_fill(page, first);
    boot_page_fill(page + 2, second);
    boot_page_write(page);
    write_cycles = finish();
}

// SPM does nothing here.
__attribute__((section(".below"), noinline)) static void fill_from_below(uint16_t value) {
    boot_page_fill(0x4200, value);
}

static void announce_and_wait(uint16_t page) {
    __asm__ volatile(
        "sts %[control], %[what] \n"
        "nop\n nop\n nop\n nop\n nop\n nop\n"
        "spm                     \n"
        :
        : [control] "i"(_SFR_MEM_ADDR(__SPM_REG)), [what] "r"((uint8_t)__BOOT_PAGE_WRITE),
          "z"(page));
}

int main(void) {
    TCCR1B = 1 << CS10;
    write(0x4000, 0xF0FF, 0x1234);
    write(0x4000, 0x3CFF, 0xFFFF);
    both_writes = pgm_read_word(0x4000);
    unwritten_word = pgm_read_word(0x4002);

    boot_page_fill(0x4100, 0x1111);
    write(0x4100, 0x2222, 0x3333);
    first_fill = pgm_read_word(0x4100);

    fill_from_below(0x4444);
    write(0x4200, 0x5555, 0x5555);
    from_below = pgm_read_word(0x4200);

    boot_page_fill(0x4300, 0x6666);
    announce_and_wait(0x4300);
    finish();
    too_late = pgm_read_word(0x4300);

    boot_page_erase(0x4200);
    while_busy = pgm_read_word(0x4000);
    busy_bits = SPMCSR;
    TCNT1 = 0;
    while (boot_spm_busy()) {
    }
    erase_cycles = TCNT1;
    idle_bits = SPMCSR;
    while_not_enabled = pgm_read_word(0x4000);
    boot_rww_enable();
    after_enable = pgm_read_word(0x4000);
    done = 1;
    for (;;) {
    }
}
