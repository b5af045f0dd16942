/// Says that sources shared by robots and modules are being compiled for a robot.
#ifndef KILOGRID_PLATFORM_H
#define KILOGRID_PLATFORM_H

#define KILOBOT

#endif
