#include "kilob_cdms.h"

#include <stdbool.h>

// In order of age, the oldest first: groups are small, and moving them up costs little.
static opinion_info_t known[OPINION_BUFFER_CAPACITY];
static volatile uint8_t count;
static uint8_t opinions, group;

int kilob_cdms_init(uint8_t number_of_opinions, uint8_t group_size) {
    if (group_size >= OPINION_BUFFER_CAPACITY) return 1;
    opinions = number_of_opinions;
    group = group_size;
    kilob_cdms_clear_buffer();
    return 0;
}

// Below `end`. g_ran_uniform() has both ends of its interval, and the lowest bit here is always 0.
static uint8_t draw(uint8_t end) { return (uint8_t)((g_ran_uniform_uint32() >> 1) % end); }

opinion_t kilob_cdms_random_opinion(void) { return draw(opinions); }

void kilob_cdms_clear_buffer(void) { count = 0; }

// Those behind it move up, so that a place is free at the end.
static void forget(uint8_t index) {
    count--;
    for (uint8_t i = index; i < count; i++) known[i] = known[i + 1];
}

// A group of nobody keeps nothing.
void kilob_cdms_collect(uint8_t kilouid, opinion_t opinion, double quality) {
    for (uint8_t i = 0; i < count; i++)
        if (known[i].kilo_id == kilouid) {
            forget(i);
            break;
        }
    if (group == 0) return;
    if (count == group) forget(0);
    const opinion_info_t info = {kilouid, opinion, quality};
    known[count++] = info;
}

unsigned kilob_cdms_count_collected_opinions(void) { return count; }

opinion_info_t kilob_cdms_collected_opinion_info(unsigned index) { return known[index]; }

// A tie anywhere at the top keeps the robot's own opinion, even if that is not among the best.
opinion_t kilob_cdms_majority_rule(opinion_t self) {
    opinion_t best = self;
    uint8_t most = 0;
    bool several = false;
    for (opinion_t opinion = 0; opinion < opinions; opinion++) {
        uint8_t votes = opinion == self;
        for (uint8_t i = 0; i < count; i++)
            if (known[i].opinion == opinion) votes++;
        if (votes == most) several = true;
        if (votes <= most) continue;
        best = opinion;
        most = votes;
        several = false;
    }
    return several ? self : best;
}

opinion_t kilob_cdms_voter_model(opinion_t self) {
    uint8_t drawn;
    return kilob_cdms_voter_model_with_kilouid(self, &drawn);
}

opinion_t kilob_cdms_voter_model_with_kilouid(opinion_t self, uint8_t *choosen_kilouid) {
    // One that comes in meanwhile does not count.
    const uint8_t there = count;
    *choosen_kilouid = (uint8_t)kilo_uid;
    if (there == 0) return self;
    const opinion_info_t *neighbour = &known[draw(there)];
    *choosen_kilouid = neighbour->kilo_id;
    return neighbour->opinion;
}

opinion_t kilob_cdms_unanimity_rule(opinion_t self) {
    if (count == 0) return self;
    for (uint8_t i = 1; i < count; i++)
        if (known[i].opinion != known[0].opinion) return self;
    return known[0].opinion;
}

opinion_t kilob_cdms_direct_comparison(opinion_t self, double quality) {
    for (uint8_t i = 0; i < count; i++) {
        if (known[i].quality <= quality) continue;
        self = known[i].opinion;
        quality = known[i].quality;
    }
    return self;
}

void kilob_cdms_get_last_neighborhoods(uint8_t kilouids[]) {
    for (uint8_t i = 0; i < count; i++) kilouids[i] = known[i].kilo_id;
}
