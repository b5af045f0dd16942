// Linked only into programs that read a sensor, by a function or a register. Of others the engine
// need not know when light falls on their receiver.
#include "side.h"

int16_t kt_sensor(uint8_t channel) { return kt_host->sensor(channel); }
