/// Says that sources shared by robots and modules are being compiled for a module.
#ifndef KILOGRID_PLATFORM_H
#define KILOGRID_PLATFORM_H

#define MODULE

#endif
