"""The emulated buses for programs outside: settings of the engine's bridge and their defaults."""

from collections.abc import Sequence

from kilotwin import _emulator
from kilotwin.table.can.address import SOCKETCAND_PORT


def open_bridge(
    *,
    buses: int,
    port: int = SOCKETCAND_PORT,
    more_ports: int = 15,
    interfaces: Sequence[str] = (),
    client_bytes: int = 1 << 20,
    client_frames: int = 1024,
    clients: int = 64,
    settle_s: float = 0.2,
) -> "_emulator.Bridge":
    """Buses can0 to can{buses - 1} on 127.0.0.1, as emulator/grid/bridge.h says; BridgeError.

    `port` 0: any free one; in use: one of the `more_ports` behind it. `interfaces`: real SocketCAN
    interfaces instead, one for each bus. A client is dropped when `client_bytes` of text for it
    wait, and is read no further while `client_frames` of its frames wait; at most `clients` at the
    same time. A client that has just asked for frames gets none for `settle_s`.
    """
    return _emulator.Bridge(
        buses=buses,
        port=port,
        more_ports=more_ports,
        interfaces=list(interfaces),
        client_bytes=client_bytes,
        client_frames=client_frames,
        clients=clients,
        settle_s=settle_s,
    )
