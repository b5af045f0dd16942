#include "robots/translated/image.h"

namespace kilotwin {

TranslatedImage switched_on() {
    using namespace atmega328p;
    constexpr uint16_t STACK = SRAM_END - 1;
    TranslatedImage image = {};
    image.data[SPL] = STACK & 0xFF;
    image.data[SPH] = STACK >> 8;
    image.data[PIND] = 1;  // no charger is at work
    image.data[UCSR0A] = UCSR0A_UDRE;
    image.match = image.flagged = TranslatedImage::NO_TIME;
    return image;
}

}  // namespace kilotwin
