// Messages of collective perception (docs/collective_perception.md 1).
#ifndef COLLECTIVE_PERCEPTION_MESSAGES_H
#define COLLECTIVE_PERCEPTION_MESSAGES_H

#define OPTIONS 5

#define MESSAGE_OPINION 0x00  // robot to robots: uid, opinion, matched, explored, low bytes each
#define MESSAGE_CELL 0x11     // cell to robots

// Bytes of MESSAGE_CELL.
#define CELL_OPTION 0
#define CELL_IS_WALL 1

// A cell's byte of its module's configuration.
#define CONFIG_OPTION 0x0F
#define CONFIG_WALL 0x10

#endif
