"""Robots that keys name: by their uids."""

from collections.abc import Sequence

_MOST = 20  # that are listed


def uids_text(uids: Sequence[int]) -> str:
    """`the robots are 1 to 10`, or `... 3, 17 and 40` of a lab's; for messages."""
    if len(uids) == 1:
        return f"the robot is {uids[0]}"
    if list(uids) == list(range(uids[0], uids[-1] + 1)):
        return f"the robots are {uids[0]} to {uids[-1]}"
    if len(uids) > _MOST:
        return f"the {len(uids)} robots are {', '.join(map(str, uids[:_MOST]))} ..."
    return f"the robots are {', '.join(map(str, uids[:-1]))} and {uids[-1]}"
