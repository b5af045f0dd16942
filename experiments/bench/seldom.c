/// Walks, and says something twice a minute or so; asked for a message at other times, it has none.
#include <stddef.h>

#include "talker.h"
#include "walker.h"

static bool has_news;
static uint32_t news_at;

static message_t *say_news(void) { return has_news ? &message : NULL; }
static void said(void) { has_news = false; }

static void wait_for_news(void) {
    news_at = kilo_ticks + 16u * TICKS_PER_SEC + 4u * (uint32_t)between(0, 255);
}

static void setup(void) {
    kilo_message_tx_success = said;
    begin_to_walk();
    wait_for_news();
}

static void loop(void) {
    walk();
    if (kilo_ticks < news_at) return;
    has_news = true;
    wait_for_news();
}

int main(void) {
    prepare_to_talk(say_news);
    kilo_start(setup, loop);
    return 0;
}
