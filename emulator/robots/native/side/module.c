// The thin half of the mock Kilogrid module API: it is compiled into every module's guest, so that
// the API's plain variables are swapped with the program's own.
#include "../../../../kilogrid_modules/runtime/include/module.h"

#include <stddef.h>

#include "../../../../firmware/kilolib/core/random.h"
#include "../../../../kilogrid_modules/runtime/core/api.h"
#include "../../../../kilogrid_modules/runtime/core/light_patterns.h"
#include "../../../../kilogrid_modules/runtime/core/traits.h"
#include "abi.h"
#include "moduleIR.h"
#include "moduleLED.h"
#include "side.h"

_Static_assert(sizeof(CAN_message_t) == sizeof(kt_can_message_t), "CAN_message_t is packed");
_Static_assert(sizeof(IR_message_t) == sizeof(message_t), "the two flavours are one message");
_Static_assert(sizeof(kilogrid_address_t) == 3, "kilogrid_address_t is x, y, type");

volatile uint16_t module_uid;
volatile uint8_t module_uid_x_coord;
volatile uint8_t module_uid_y_coord;
volatile uint32_t module_ticks;
volatile uint8_t configuration_size;
volatile uint8_t configuration[MODULE_CONFIGURATION_BUFFER_SIZE];

static void ignore_ir_rx(IR_message_t *message, cell_num_t cell, distance_measurement_t *distance,
                         uint8_t crc_error) {
    (void)message, (void)cell, (void)distance, (void)crc_error;
}
static void ignore_ir_tx_success(cell_num_t cell) { (void)cell; }
static void ignore_can_rx(CAN_message_t *message) { (void)message; }
static void ignore_can_tx_success(void) {}

IR_message_rx_t module_IR_message_rx = ignore_ir_rx;
IR_message_tx_success_t module_IR_message_tx_success = ignore_ir_tx_success;
CAN_message_rx_t module_CAN_message_rx = ignore_can_rx;
CAN_message_tx_success_t module_CAN_message_tx_success = ignore_can_tx_success;

// Packed types have alignment 1; the engine writes whole words.
static message_t cell_messages[N_CELLS] __attribute__((aligned(4)));
static distance_measurement_t distance __attribute__((aligned(4)));
static CAN_message_t can_message;
static kt_records_t records;

// Only programs that send by themselves link it (module_send.c).
extern __attribute__((weak, visibility("hidden"))) const uint8_t kt_acts_alone;

static const kt_module_t module = {
    .uid = &module_uid,
    .x = &module_uid_x_coord,
    .y = &module_uid_y_coord,
    .configuration_size = &configuration_size,
    .configuration = configuration,
    .ir_rx =
        (void (**)(message_t *, uint8_t, distance_measurement_t *, uint8_t)) & module_IR_message_rx,
    .ir_tx_success = (void (**)(uint8_t)) & module_IR_message_tx_success,
    .can_rx = (void (**)(kt_can_message_t *)) & module_CAN_message_rx,
    .can_tx_success = &module_CAN_message_tx_success,
    .can_message = (kt_can_message_t *)&can_message,
    .records = &records,
    .acts_alone = &kt_acts_alone,
};

const kt_table_t kt_table = {
    .abi = KT_GUEST_ABI,
    .guard_low = (uint8_t *)kt_guard_low,
    .state_begin = kt_state_begin,
    .state_end = kt_state_end,
    .guard_high = (uint8_t *)kt_guard_high,
    .program_main = kt_run_program,
    .ticks = &module_ticks,
    .rx_message = cell_messages,
    .rx_distance = &distance,
    .outputs = &kt_outputs,
    .settle = kt_settle,
    .handlers_begin = __start_kt_handlers,
    .handlers_end = __stop_kt_handlers,
    .random = rand,
    .budget = &kt_budget,
    .host = &kt_host,
    .module = &module,
    .original = MODULE_ORIGINAL,
};

void module_init(void) { kt_host->init(); }
void module_start(void (*setup)(void), void (*loop)(void)) { kt_host->start(setup, loop); }
void module_enable_autostart(void) { kt_host->module->autostart(); }

void rand_set_seed(uint8_t seed) { kilolib_random_seed(seed); }
uint16_t get_random(uint16_t low, uint16_t high) { return api_in_range(low, high, rand()); }

CAN_message_t *next_CAN_message(void) {
    const uint8_t place = record_store_add(&records.store);
    return place == RECORD_STORE_FULL ? NULL : (CAN_message_t *)&records.slots[place];
}

void init_CAN_message(CAN_message_t *message) { api_init_can_message(message); }

void serialize_tracking_message(CAN_message_t *message, uint8_t cell, tracking_user_data_t *data) {
    api_fill_record(message, cell, data);
}

kilogrid_address_t get_coord_from_CAN_ID(CAN_message_t *message) {
    kilogrid_address_t address = {0, 0, ADDR_BROADCAST};
    kt_host->module->can_address(message->id, (uint8_t *)&address);
    return address;
}

void init_IR_message(IR_message_t *message) { memset(message, 0, sizeof *message); }

void set_IR_message(IR_message_t *message, cell_num_t cell) {
    if (message == NULL) return disable_IR_tx(cell);
    kt_host->module->cell_message(cell, message, message_crc);
}

void disable_IR_tx(cell_num_t cell) { kt_host->module->cell_message(cell, NULL, NULL); }

uint8_t estimate_distance_mm(const distance_measurement_t *measured, cell_num_t cell) {
    (void)cell;
    return kt_host->distance_mm(measured->low_gain, measured->high_gain);
}

void set_LED_with_brightness(cell_num_t cell, color_t color, brightness_t brightness) {
    kt_host->module->light(cell, color_part(color, brightness, 0), color_part(color, brightness, 1),
                           color_part(color, brightness, 2));
}

void set_LED(cell_num_t cell, color_t color) { set_LED_with_brightness(cell, color, ADJUSTED); }

void set_all_LEDs_with_brightness(color_t color, brightness_t brightness) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) set_LED_with_brightness(cell, color, brightness);
}

void set_all_LEDs(color_t color) { set_all_LEDs_with_brightness(color, ADJUSTED); }

void set_all_LEDs_hex(uint8_t rgb[3]) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++)
        kt_host->module->light(cell, rgb[0], rgb[1], rgb[2]);
}
