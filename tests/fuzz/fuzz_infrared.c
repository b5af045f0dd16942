/// Fuzz target: a robot's receiver, its runtime and its boot loader, which hear any light. Each two
/// bytes of the input are the cycles to the next edge; an input that begins with an odd byte is
/// messages instead, with their CRC put right, so that the decoders behind it are reached.
#include <assert.h>
#include <string.h>

#include "bootloader/core/boot_messages.h"
#include "kilolib/core/infrared_frame.h"
#include "kilolib/core/robot_commands.h"
#include "message_crc.h"

#include "flash_in_memory.h"

#define UID 0x1234

typedef struct {
    infrared_reader_t reader;
    robot_core_t robot;
    image_store_t store;
} robot_t;

static void check_answers(robot_t *robot, uint8_t first) {
    message_t answer;
    boot_message_report(&robot->store, first, UID, &answer);
    assert(message_crc(&answer) == answer.crc);
}

static void take(robot_t *robot, const message_t *message) {
    if (message_crc(message) != message->crc) return;
    if (message_is_command(message)) {
        robot_obey(&robot->robot, message, UID, 60);
        assert(robot->robot.state <= ROBOT_MOVING);
    }
    boot_query_t query;
    if (boot_message_take(&robot->store, message, UID, &query) == BOOT_ORDER_ANSWER)
        check_answers(robot, query.first);
    for (int i = 0; i < 3; i++) image_store_work(&robot->store);
    assert(robot->store.state <= STORE_WRONG);
    assert(robot->store.stored <= BOOT_PAGES && robot->store.image.pages <= BOOT_PAGES);
}

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size) {
    static robot_t robot;
    memset(&robot, 0, sizeof robot);
    memset(flash, BOOT_BLANK, sizeof flash);
    robot_core_init(&robot.robot);
    image_store_init(&robot.store);
    if (size > 0 && input[0] % 2 == 1) {
        message_t message;
        for (size_t at = 1; size - at >= 10; at += 10) {
            memcpy(message.data, input + at, 9);
            message.type = input[at + 9];
            message.crc = message_crc(&message);
            take(&robot, &message);
        }
        return 0;
    }
    uint16_t now = 0;
    for (size_t at = 0; at + 1 < size; at += 2) {
        now = (uint16_t)(now + (uint16_t)(input[at] | input[at + 1] << 8));
        const infrared_edge_t edge = infrared_reader_edge(&robot.reader, now);
        assert(robot.reader.bytes < FRAME_BYTES);
        if (edge == EDGE_COMPLETES) take(&robot, &robot.reader.message);
    }
    return 0;
}
