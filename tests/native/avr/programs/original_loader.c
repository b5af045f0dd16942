// A robot's boot loader as the published ones behave (hardware.md 1.11), written from that: no CRC
// but a frame's, a page is written when 128 bytes of it have been counted, the last page starts the
// program, and nothing is answered. Linked to 0x7000.
#define F_CPU 8000000UL
#include <avr/boot.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <string.h>
#include <util/crc16.h>
#include <util/delay.h>

#define SLOT 269
#define FRAME_BYTES 12
#define TYPE 9
#define MOST_PAGES 220
#define NO_PAGE 0xFF
enum { BOOT = 0x80, PAGE = 0x81, SIZE = 0x82 };

static volatile uint8_t has_message;
static uint8_t frame[FRAME_BYTES], message[FRAME_BYTES];
static uint8_t in_byte, leader_due, byte_index, bits;
static uint8_t buffer[SPM_PAGESIZE], is_written[MOST_PAGES];
static uint8_t pages, stored, page, counted;

static void color(uint8_t blue, uint8_t green) {
    DDRC = (DDRC & ~(1 << 5 | 1 << 3)) | blue << 5 | green << 3;
}

static void end_of_frame(void) {
    TCCR1B = 0;
    TCNT1 = 0;
    in_byte = 0;
    leader_due = 1;
}

ISR(TIMER1_COMPA_vect) { end_of_frame(); }

ISR(ANALOG_COMP_vect) {
    const uint16_t at = TCNT1;
    if (!in_byte) {
        TCNT1 = 0;
        TCCR1B = 1;
        bits = 0;
        in_byte = 1;
        return;
    }
    if (at <= SLOT / 2 || at >= 9 * SLOT + SLOT / 2) return end_of_frame();
    // A division would take longer than a slot.
    const uint8_t slot = ((uint32_t)(at - SLOT / 2) * (65536 / SLOT + 1)) >> 16;
    if (slot < 8) {
        bits |= 1 << slot;
        return;
    }
    in_byte = 0;
    if (leader_due) {
        byte_index = 0;
        leader_due = 0;
        if (bits != 0) end_of_frame();
        return;
    }
    frame[byte_index++] = bits;
    if (byte_index < FRAME_BYTES) return;
    end_of_frame();
    memcpy(message, frame, sizeof frame);
    has_message = 1;
}

static uint8_t crc_is_right(void) {
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i <= TYPE; i++) crc = _crc_ccitt_update(crc, message[i]);
    return message[10] == (uint8_t)crc && message[11] == crc >> 8;
}

static void __attribute__((noreturn)) start_application(void) {
    cli();
    ACSR = TIMSK1 = TCCR1B = 0;
    DDRB = DDRC = DDRD = PORTB = PORTC = PORTD = 0;
    MCUCR = 1 << IVCE;
    MCUCR = 0;
    __asm__ volatile("jmp 0");
    __builtin_unreachable();
}

static void write_page(void) {
    const uint16_t address = (uint16_t)page * SPM_PAGESIZE;
    cli();
    boot_page_erase(address);
    boot_spm_busy_wait();
    for (uint8_t i = 0; i < SPM_PAGESIZE; i += 2)
        boot_page_fill(address + i, buffer[i] | buffer[i + 1] << 8);
    boot_page_write(address);
    boot_spm_busy_wait();
    boot_rww_enable();
    sei();
    is_written[page] = 1;
    color(0, 1);
    if (++stored >= pages) start_application();
}

static void take_words(void) {
    if (message[0] >= MOST_PAGES || is_written[message[0]]) return;
    if (message[0] != page) {
        page = message[0];
        counted = 0;
        color(1, 0);
    }
    for (uint8_t i = 0; i < 6; i++)
        if (message[1] * 2 + i < SPM_PAGESIZE) buffer[message[1] * 2 + i] = message[2 + i];
    counted += 6;
    if (counted >= SPM_PAGESIZE) write_page();
}

static void forget(void) {
    memset(is_written, 0, sizeof is_written);
    pages = stored = counted = 0;
    page = NO_PAGE;
}

static void obey(void) {
    if (!crc_is_right()) return;
    switch (message[TYPE]) {
    case BOOT: forget(); break;
    case SIZE: pages = message[0]; break;
    case PAGE:
        if (pages > 0) take_words();
        break;
    default:
        if (stored == 0) start_application();
    }
}

int main(void) {
    cli();
    MCUCR = 1 << IVCE;
    MCUCR = 1 << IVSEL;
    TIMSK0 = 0;
    DDRB = DDRC = DDRD = PORTB = PORTC = PORTD = 0;
    DDRD |= 1 << 2;
    PORTD |= 1 << 2;
    TCCR1A = TCCR1B = 0;
    OCR1A = 11 * SLOT;
    TIMSK1 = 1 << OCIE1A;
    ACSR = 1 << ACIE | 1 << ACIS1 | 1 << ACIS0;
    DIDR1 = 3;
    forget();
    end_of_frame();
    sei();
    for (uint16_t ms = 0;; ms++) {
        for (uint8_t i = 0; i < 10; i++) {
            _delay_us(100);
            if (!has_message) continue;
            has_message = 0;
            obey();
        }
        if (counted == 0 && stored == 0) color(ms % 1000 < 5, 0);
    }
}
