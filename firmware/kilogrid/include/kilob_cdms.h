/// Collective decisions: opinions of neighbours, and the rules by which a robot adopts one.
///
/// The newest opinions of `group_size` different robots are kept; one that is collected again takes
/// the newest place. kilob_cdms_collect() is for the receive callback, the rest for loop(): an
/// opinion that comes in during a decision may count in it or not.
#ifndef KILOB_CDMS_H
#define KILOB_CDMS_H

#include <stdint.h>

#include "kilo_rand_lib.h"
#include "kilolib.h"
#include "message.h"

/// Opinions are numbered from 0.
typedef uint8_t opinion_t;

typedef struct {
    uint8_t kilo_id;    ///< low byte of the neighbour's uid
    opinion_t opinion;  ///< what it thinks
    double quality;     ///< how good that is, 0 to 1; only direct comparison looks at it
} opinion_info_t;

/// Most opinions that can be kept; a program may define fewer before.
#ifndef OPINION_BUFFER_CAPACITY
#define OPINION_BUFFER_CAPACITY 32
#endif

/// How many opinions there are, and how many neighbours' are kept, less than
/// OPINION_BUFFER_CAPACITY. Returns 1, and changes nothing, if `group_size` is more; else 0.
int kilob_cdms_init(uint8_t number_of_opinions, uint8_t group_size);

/// Any opinion with equal chance.
opinion_t kilob_cdms_random_opinion(void);

/// Forgets all opinions of neighbours.
void kilob_cdms_clear_buffer(void);

/// Takes in a neighbour's opinion; the oldest one goes when there are more than the group has.
void kilob_cdms_collect(uint8_t kilouid, opinion_t opinion, double quality);

/// How many are kept.
unsigned kilob_cdms_count_collected_opinions(void);

/// The one at `index`, 0 is the oldest; below kilob_cdms_count_collected_opinions().
opinion_info_t kilob_cdms_collected_opinion_info(unsigned index);

/// An exponential time with this mean, in its unit.
static inline double kilob_cdms_duration(double mean) { return g_ran_exponential(1.0 / mean); }

/// The commonest opinion of neighbours and `self` together; `self` if several are.
opinion_t kilob_cdms_majority_rule(opinion_t self);

/// The opinion of a neighbour drawn by chance; `self` if there is none.
opinion_t kilob_cdms_voter_model(opinion_t self);

/// The same, and that neighbour's id (this robot's own if there is none).
opinion_t kilob_cdms_voter_model_with_kilouid(opinion_t self, uint8_t *choosen_kilouid);

/// The opinion of all neighbours if they agree; else `self`.
opinion_t kilob_cdms_unanimity_rule(opinion_t self);

/// The opinion of the neighbour with the highest quality above `quality`; else `self`.
opinion_t kilob_cdms_direct_comparison(opinion_t self, double quality);

/// Ids of the neighbours kept, the oldest first; `kilouids` has room for all.
void kilob_cdms_get_last_neighborhoods(uint8_t kilouids[]);

#endif
