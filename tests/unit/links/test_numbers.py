"""Numbers that host and firmware share are the same on both sides."""

import re

from kilotwin.files import resources
from kilotwin.table.links.robot_link import RobotState


def test_states_are_numbered_as_in_the_firmware() -> None:
    text = resources.path("firmware/kilolib/core/robot_commands.h").read_text()
    block = re.search(r"typedef enum \{([^}]*)\} robot_state_t;", text)
    assert block is not None
    names = re.findall(r"^\s*ROBOT_(\w+)", block[1], re.MULTILINE)
    assert names == [state.name for state in RobotState]
