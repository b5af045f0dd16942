/// Fuses that a program records for its programmer. No effect here, as on a robot that is flashed
/// by infrared.
#ifndef KT_AVR_FUSE_H
#define KT_AVR_FUSE_H

typedef struct {
    unsigned char low, high, extended;
} __fuse_t;

#define FUSES __fuse_t __fuse __attribute__((unused, section("kt_fuse")))

#define FUSE(bit) ((unsigned char)~(1 << (bit)))

// Low byte.
#define FUSE_CKSEL0 FUSE(0)
#define FUSE_CKSEL1 FUSE(1)
#define FUSE_CKSEL2 FUSE(2)
#define FUSE_CKSEL3 FUSE(3)
#define FUSE_SUT0 FUSE(4)
#define FUSE_SUT1 FUSE(5)
#define FUSE_CKOUT FUSE(6)
#define FUSE_CKDIV8 FUSE(7)
#define LFUSE_DEFAULT (FUSE_CKSEL0 & FUSE_CKSEL2 & FUSE_CKSEL3 & FUSE_SUT0 & FUSE_CKDIV8)

// High byte.
#define FUSE_BOOTRST FUSE(0)
#define FUSE_BOOTSZ0 FUSE(1)
#define FUSE_BOOTSZ1 FUSE(2)
#define FUSE_EESAVE FUSE(3)
#define FUSE_WDTON FUSE(4)
#define FUSE_SPIEN FUSE(5)
#define FUSE_DWEN FUSE(6)
#define FUSE_RSTDISBL FUSE(7)
#define HFUSE_DEFAULT (FUSE_BOOTSZ0 & FUSE_BOOTSZ1 & FUSE_SPIEN)

// Extended byte.
#define FUSE_BODLEVEL0 FUSE(0)
#define FUSE_BODLEVEL1 FUSE(1)
#define FUSE_BODLEVEL2 FUSE(2)
#define EFUSE_DEFAULT 0xFF

#define FUSE_MEMORY_SIZE 3

#endif
