"""A client of a shared haptic room. The force is displayed by a thread of libtandem, not of Python.

    with tandem.Client(server="127.0.0.1:47800", is_insecure=True) as client:
        client.grab()
        print(client.snapshot().on_hand_D.force_n)

The `with` statement joins the room and starts the 1 kHz loop. Its end ramps the force to zero and leaves the room.
"""

from ._tandem import *  # noqa: F403
from ._tandem import __version__, protocol_version  # noqa: F401
