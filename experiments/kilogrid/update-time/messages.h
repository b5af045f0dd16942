// Messages of the update-time experiment (docs/update_time.md).
#ifndef UPDATE_TIME_MESSAGES_H
#define UPDATE_TIME_MESSAGES_H

#define MESSAGE_CELL 1   // cell to robots
#define MESSAGE_ROBOT 2  // a robot that stays, to robots

// Bytes of MESSAGE_CELL.
#define CELL_COLOUR 0
#define CELL_IS_WALL 1

// Values of CELL_COLOUR.
#define BLACK 20
#define WHITE_CELL 21
#define GREY 22

// In place of a grid, Kilotwin's virtual floor says on which of the sites of their-table.toml a robot
// is: black, white, and four of wall cells.
#define FLOOR_BLACK 1
#define FLOOR_WHITE 2

// Bytes of MESSAGE_ROBOT.
#define ROBOT_UID 0
#define ROBOT_WEIGHT 1

#endif
