/// Signature of the processor that a program is for, recorded in its file.
#ifndef KT_AVR_SIGNATURE_H
#define KT_AVR_SIGNATURE_H

#include "io.h"

static const unsigned char __signature[3]
    __attribute__((unused, section("kt_signature"))) = {SIGNATURE_2, SIGNATURE_1, SIGNATURE_0};

#endif
