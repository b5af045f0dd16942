/// The build id of an image, compiled into it once for each program: what it was made of.
///
/// BUILD_ID is the text, 1 to 255 characters of ASCII. It lies in flash behind everything else
/// (build_id.ld) and changes no other byte; nothing in the image refers to it. It is read from its
/// end backwards, by the mark. Layout and words: host_tools/kilotwin/files/build_id.py.
#include <stdint.h>

#define MARK "KTID"

static const struct {
    char text[sizeof BUILD_ID - 1];
    uint8_t length;  // of the text
    char mark[sizeof MARK - 1];
} build_id __attribute__((section(".build_id"), used)) = {BUILD_ID, sizeof BUILD_ID - 1, MARK};
