// Computes with floats in every pass, prints now and then, and shows what came of it.
#include <kilolib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static float position = 1, speed = 0.3f, energy;
static uint32_t passes;
static message_t message;
static char text[24];

static message_t *offer(void) { return &message; }

static void take(message_t *received, distance_measurement_t *distance) {
    speed += (float)estimate_distance(distance) / (float)(received->data[0] + 1);
}

static void setup(void) {
    message.type = NORMAL;
    srand(kilo_uid);
}

static void loop(void) {
    passes++;
    speed = speed * 0.999f - position * 0.01f;
    position += speed * 0.1f;
    energy = 0.5f * speed * speed + 0.005f * position * position;
    if (passes % 64 == 0) {
        const float turn = atan2f(position, speed);
        set_color(RGB((int)(turn + 4) & 3, (int)(energy * 8) & 3, (int)sqrtf(fabsf(position)) & 3));
        snprintf(text, sizeof text, "%ld %d", (long)(position * 1000), rand());
        message.data[0] = (uint8_t)text[0];
        message.data[1] = (uint8_t)(int8_t)(turn * 40);
        message.crc = message_crc(&message);
        set_motors((uint8_t)(expf(-fabsf(turn)) * 100), (uint8_t)(passes >> 6));
    }
}

int main(void) {
    kilo_init();
    kilo_message_tx = offer;
    kilo_message_rx = take;
    kilo_start(setup, loop);
    return 0;
}
