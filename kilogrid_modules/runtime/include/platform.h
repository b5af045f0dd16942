/// MODULE: sources shared by robots and modules are being compiled for a module. For a robot a
/// header of the same name defines KILOBOT instead.
#ifndef KILOGRID_PLATFORM_H
#define KILOGRID_PLATFORM_H

#define MODULE

#endif
