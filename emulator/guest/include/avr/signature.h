/// A program's note of the processor that it is for.
#ifndef KT_AVR_SIGNATURE_H
#define KT_AVR_SIGNATURE_H

#include "io.h"

static const unsigned char __signature[3]
    __attribute__((unused, section("kt_signature"))) = {SIGNATURE_2, SIGNATURE_1, SIGNATURE_0};

#endif
