/// Lets programs written for the Kilombo simulator compile as ordinary Kilobot programs.
///
/// Such programs keep their variables in one structure and reach it through `mydata`.
#ifndef KILOMBO_H
#define KILOMBO_H

#include "kilolib.h"

/// At file scope, once in a program, with or without a semicolon after it: the one instance of
/// TYPE, zero at the start, and the pointer `mydata` to it.
#define REGISTER_USERDATA(TYPE) \
    TYPE myuserdata;            \
    TYPE *mydata = &myuserdata;

/// Callbacks of the simulator's own; a robot has none of them.
#define SET_CALLBACK(ID, CALLBACK)

/// The same as variables, which older programs set. Nothing calls what they hold. A program may
/// declare them `extern` once more.
static char *(*callback_botinfo)(void)__attribute__((unused));
static void (*callback_F5)(void) __attribute__((unused));
static void (*callback_F6)(void) __attribute__((unused));
static void (*callback_global_setup)(void) __attribute__((unused));
static int16_t (*user_obstacles)(double, double, double *, double *) __attribute__((unused));
static int16_t (*user_light)(double, double) __attribute__((unused));

#endif
