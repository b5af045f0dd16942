/// Traits of the published module library that a module's runtime has if it is built with
/// MODULE_ORIGINAL = 1: it is the runtime of the modules that labs have, as far as what it does
/// otherwise is known (hardware.md 3.2, 3.7, docs/wire.md). Without, it is ours.
///
/// - Frames that are Kilotwin's own, requests for health and questions to robots, are the
///   program's, and so are robots' answers to such questions.
/// - A program for the robots has no check, and a lap of it ends when as many pages have come as
///   were announced, not with the next announcement.
/// - A page whose first chunk was lost is sent with the bytes that were there before.
/// - The frames of a page follow each other without a gap.
///
/// What frames change is original_orders.h. On the chip the traits cost nothing where they are off.
/// A driver that serves modules of both kinds asks each module's program which it is.
#ifndef MODULE_CORE_TRAITS_H
#define MODULE_CORE_TRAITS_H

#ifndef MODULE_ORIGINAL
#define MODULE_ORIGINAL 0
#endif

#endif
