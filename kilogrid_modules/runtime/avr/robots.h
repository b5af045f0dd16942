/// What the module tells the robots on behalf of the host.
#ifndef MODULE_AVR_ROBOTS_H
#define MODULE_AVR_ROBOTS_H

/// Once, by each cell, the message that is to be repeated; then the lights of its command.
void runtime_repeat_message(void);

/// RUN, ten times by each cell.
void runtime_start_robots(void);

/// The page that is in, by one cell.
void runtime_send_page(void);

#endif
