/// Infrared messages to the robots on behalf of the host: the driver of core/bursts.h.
#ifndef MODULE_AVR_ROBOTS_H
#define MODULE_AVR_ROBOTS_H

#include "../core/main_loop.h"

/// Sends the burst of a job and shows its lights. From the main loop; takes 4.4 ms a frame, 180 ms
/// at most.
void runtime_send_burst(job_t job);

#endif
