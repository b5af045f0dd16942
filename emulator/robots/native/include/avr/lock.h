/// Lock bits that a program records for its programmer. No effect here.
#ifndef KT_AVR_LOCK_H
#define KT_AVR_LOCK_H

#define LOCKBITS unsigned char __lock __attribute__((unused, section("kt_lock")))

#define LB_MODE_1 0xFF
#define LB_MODE_2 0xFE
#define LB_MODE_3 0xFC
#define BLB0_MODE_1 0xFF
#define BLB0_MODE_2 0xFB
#define BLB0_MODE_3 0xF3
#define BLB0_MODE_4 0xF7
#define BLB1_MODE_1 0xFF
#define BLB1_MODE_2 0xEF
#define BLB1_MODE_3 0xCF
#define BLB1_MODE_4 0xDF
#define LOCKBITS_DEFAULT 0xFF

#endif
