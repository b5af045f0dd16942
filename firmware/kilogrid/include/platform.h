/// KILOBOT: sources shared by robots and modules are being compiled for a robot. On a module a
/// header of the same name defines MODULE instead.
#ifndef KILOGRID_PLATFORM_H
#define KILOGRID_PLATFORM_H

#define KILOBOT

#endif
