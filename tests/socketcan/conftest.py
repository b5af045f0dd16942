"""Real SocketCAN: in this kernel if it has it, else in a User-Mode Linux kernel.

The other files need vcan0 to vcan3. Where they are missing, only `test_in_user_mode_linux.py` is
collected here, which runs them there.
"""

import shutil
import socket
import subprocess

BUSES = ["vcan0", "vcan1", "vcan2", "vcan3"]


def _add(bus: str) -> bool:
    """Whether the bus could be set up, where that is allowed."""
    ip = shutil.which("ip")
    if ip is None:
        return False
    commands = [[ip, "link", "add", bus, "type", "vcan"], [ip, "link", "set", bus, "up"]]
    return all(
        subprocess.run(command, capture_output=True, check=False).returncode == 0
        for command in commands
    )


def has_socketcan() -> bool:
    """Whether this kernel has SocketCAN and the buses are there or can be made."""
    try:
        socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        return False
    there = {name for _, name in socket.if_nameindex()}
    return all(bus in there or _add(bus) for bus in BUSES)


collect_ignore = (
    ["test_in_user_mode_linux.py"]
    if has_socketcan()
    else ["test_bridge_on_socketcan.py", "test_table_on_socketcan.py"]
)
