/// The old name of <util/crc16.h>.
#ifndef KT_AVR_CRC16_H
#define KT_AVR_CRC16_H

#include "../util/crc16.h"

#endif
