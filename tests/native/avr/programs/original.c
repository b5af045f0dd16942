// A robot's runtime and program in one, wired as those published before ours are: receives in the
// comparator's interrupt by polling the converter, times pulses by a timer that it starts and
// stops, sends from within the timer's interrupt, moves the LED by DDR alone, obeys RUN, RESET,
// SLEEP and BOOT.
#define F_CPU 8000000UL
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdlib.h>
#include <util/crc16.h>
#include <util/delay.h>

#define SLOT 269
#define FRAME_BYTES 12
#define TYPE 9
enum { BOOT = 0x80, RESET = 0x83, SLEEP = 0x84, RUN = 0x88 };
enum { IDLE, RUNNING, SLEEPING };

volatile uint8_t state, receiving, heard, from, sent, failed;
volatile uint16_t high, low;
volatile uint32_t ticks;
volatile uint8_t starts __attribute__((section(".noinit")));
static uint8_t frame[FRAME_BYTES], out[FRAME_BYTES];
static uint8_t in_byte, leader_due, byte_index, bits, ir_mask, increment;
static uint16_t clock;

static void __attribute__((naked, used, section(".init3"))) watchdog_off(void) {
    MCUSR = 0;
    wdt_disable();
}

ISR(WDT_vect) { wdt_disable(); }

static void listen_to(uint8_t channel) {
    ADMUX = channel;
    ADCSRA = 1 << ADEN | 1 << ADATE | 1 << ADPS1 | 1 << ADPS0;
    ADCSRB = 1 << ADTS0;
}

static uint16_t converted(void) {
    while ((ADCSRA & 1 << ADSC) != 0) {
    }
    return ADC;
}

static uint16_t crc_of(const uint8_t *bytes) {
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i <= TYPE; i++) crc = _crc_ccitt_update(crc, bytes[i]);
    return crc;
}

static void pulse(uint8_t on) {
    PORTB |= on ? ir_mask : 0;
    __builtin_avr_delay_cycles(6);
    PORTB &= ~ir_mask;
}

// One slot: what is outside the delay takes about 38 cycles.
static void slot(uint8_t on) {
    pulse(on);
    __builtin_avr_delay_cycles(SLOT - 38);
}

static uint8_t send(const uint8_t *bytes) {
    const uint8_t ddr = DDRB;
    DDRB |= ir_mask;
    pulse(1);
    __builtin_avr_delay_cycles(2 * SLOT - 16);
    for (uint8_t i = 0; i < 235; i++) {
        if ((ACSR & 1 << ACO) != 0) {
            DDRB = ddr;
            return 0;
        }
        __asm__ volatile("nop");
    }
    pulse(1);
    __builtin_avr_delay_cycles(SLOT - 16);
    for (uint8_t i = 0; i < FRAME_BYTES; i++) {
        uint16_t pattern = 0x201 | (uint16_t)bytes[i] << 1;
        for (uint8_t n = 0; n < 10; n++, pattern >>= 1) slot(pattern & 1);
    }
    ACSR |= 1 << ACI;
    DDRB = ddr;
    return 1;
}

static void color(uint8_t red, uint8_t green) {
    DDRD = (DDRD & ~(1 << 5)) | red << 5;
    DDRC = (DDRC & ~(1 << 3)) | green << 3;
}

static void motors(uint8_t pins) {
    DDRD = (DDRD & ~(1 << 3)) | pins << 3;
    DDRB = (DDRB & ~(1 << 3)) | pins << 3;
    OCR2A = OCR2B = 0;
}

static void obey(void) {
    if (frame[TYPE] < BOOT) {
        from = frame[0];
        heard++;
        return;
    }
    if (frame[TYPE] != RUN) motors(0);
    switch (frame[TYPE]) {
    case BOOT:
        TIMSK0 = 0;
        ((void (*)(void))0x7000)();
        break;
    case RESET: ((void (*)(void))0)(); break;
    case SLEEP: state = SLEEPING; break;
    case RUN:
        motors(1);
        state = RUNNING;
        OCR2A = 70;
        OCR2B = 60;
        break;
    }
}

static void end_of_frame(void) {
    TCCR1B = 0;
    TCNT1 = 0;
    in_byte = receiving = 0;
    leader_due = 1;
}

ISR(TIMER1_COMPA_vect) {
    end_of_frame();
    listen_to(0);
}

ISR(ANALOG_COMP_vect) {
    const uint16_t at = TCNT1;
    receiving = 1;
    if (!in_byte) {
        TCNT1 = 0;
        TCCR1B = 1;
        bits = 0;
        in_byte = 1;
        if (leader_due) {
            high = converted();
            listen_to(1);
        }
        return;
    }
    if (at <= SLOT / 2 || at >= 9 * SLOT + SLOT / 2) {
        end_of_frame();
        listen_to(0);
        return;
    }
    const uint8_t which = ((uint32_t)(at - SLOT / 2) * (65536 / SLOT + 1)) >> 16;
    if (which < 8) {
        bits |= 1 << which;
        return;
    }
    in_byte = 0;
    if (leader_due) {
        low = converted();
        listen_to(0);
        byte_index = 0;
        leader_due = 0;
        if (bits != 0) end_of_frame();
        return;
    }
    frame[byte_index++] = bits;
    if (byte_index < FRAME_BYTES) return;
    end_of_frame();
    if (crc_of(frame) == (uint16_t)(frame[10] | frame[11] << 8)) obey();
}

ISR(TIMER0_COMPA_vect) {
    clock += increment;
    increment = 0xFF;
    OCR0A = increment;
    ticks++;
    if (receiving || clock <= 3906 || state != RUNNING) return;
    if (send(out)) {
        sent++;
        clock = 0;
    } else {
        failed++;
        increment = rand() & 0xFF;
        OCR0A = increment;
    }
}

static void sleep_a_while(void) {
    cli();
    ACSR &= ~(1 << ACIE);
    ADCSRA &= ~(1 << ADEN);
    DDRB = DDRC = DDRD = PORTB = PORTC = PORTD = 0;
    wdt_enable(WDTO_8S);
    WDTCSR |= 1 << WDIE;
    set_sleep_mode(SLEEP_MODE_PWR_DOWN);
    sleep_enable();
    sei();
    sleep_cpu();
    sleep_disable();
    receiving = 0;
    DDRD |= 1 << 2;
    PORTD |= 1 << 2;
    ADCSRA |= 1 << ADEN;
    _delay_us(300);
    ACSR |= 1 << ACIE | 1 << ACI;
    color(1, 1);
    _delay_ms(10);
    if (receiving) {
        color(1, 0);
        _delay_ms(100);
    }
    color(0, 0);
}

static void init(void) {
    cli();
    DDRB = DDRC = DDRD = PORTB = PORTC = PORTD = 0;
    DDRD |= 1 << 2;
    PORTD |= 1 << 2;
    TCCR0A = 0;
    TCCR0B = 1 << CS02 | 1 << CS00;
    OCR0A = 0xFF;
    TIMSK0 = 1 << OCIE0A;
    TCCR1A = TCCR1B = 0;
    OCR1A = 11 * SLOT;
    TIMSK1 = 1 << OCIE1A;
    TCCR2A = 1 << COM2A1 | 1 << COM2B1 | 1 << WGM20;
    TCCR2B = 1 << CS21;
    motors(0);
    ACSR = 1 << ACIE | 1 << ACIS1 | 1 << ACIS0;
    DIDR1 = 3;
    ADMUX = 6;
    ADCSRA = 1 << ADEN | 1 << ADPS1 | 1 << ADPS0;
    ADCSRA |= 1 << ADSC;
    srand(converted());
    listen_to(0);
    ir_mask = eeprom_read_byte((uint8_t *)0x90);
    out[0] = eeprom_read_byte((uint8_t *)0xB0);
    for (uint8_t i = 1; i <= TYPE; i++) out[i] = 0;
    const uint16_t crc = crc_of(out);
    out[10] = (uint8_t)crc;
    out[11] = (uint8_t)(crc >> 8);
    leader_due = 1;
    in_byte = receiving = 0;
    clock = 0;
    increment = 0xFF;
    ticks = 0;
    state = IDLE;
    starts++;
    sei();
}

int main(void) {
    init();
    for (;;) {
        switch (state) {
        case IDLE:
            color(0, 1);
            _delay_ms(1);
            color(0, 0);
            _delay_ms(200);
            break;
        case RUNNING: color(heard & 1, 0); break;
        case SLEEPING: sleep_a_while(); break;
        }
    }
}
