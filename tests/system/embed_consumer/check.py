"""Pulls at a body with a device that this program drives, while other Python threads compute. Prints one JSON object.
"""

import json
import sys
import threading
import time

import tandem

BUSY = True


def keep_busy():
    while BUSY:
        sum(range(1000))


def drive(device, seconds):
    """Supplies the poses of a rising hand. Returns the largest downward force [N]."""
    largest_n = 0.0
    begun = time.monotonic()
    while (at := time.monotonic() - begun) < seconds:
        device.feed([0, 0, min(0.02, 0.02 * max(0.0, at - 0.8))], buttons=tandem.BUTTON_GRAB if at > 0.3 else 0)
        largest_n = max(largest_n, -device.force().on_hand_D.force_n[2])
        time.sleep(0.001)
    return largest_n


def refused(call):
    try:
        call()
    except tandem.Error as error:
        return str(error)
    return ""


device = tandem.OwnDevice(force_limit_n=6, force_maximum_n=6, maximum_source="this test")
client = tandem.Client(server=sys.argv[1], is_insecure=True, own_device=device)
with client:
    largest_n = drive(device, 2.5)
    held = client.snapshot().held_body
    ticks = client.read_ticks()
    refusal = refused(lambda: client.point([0, 0, 0], body=77))
    busy = [threading.Thread(target=keep_busy) for _ in range(2)]
    for thread in busy:
        thread.start()
    time.sleep(0.5)
    BUSY = False
    for thread in busy:
        thread.join()
    later = client.read_ticks()
    session = client.session()
numbers = ticks.number.tolist() + later.number.tolist()
print(json.dumps({
    "held": held,
    "ticks": len(ticks),
    "ticks_while_busy": len(later),
    "lost": session.lost_ticks,
    "are_consecutive": numbers == list(range(1, len(numbers) + 1)),
    "shape": list(ticks.force_n.shape),
    "largest_n": largest_n,
    "refused": refusal,
    "after_close": "the client was closed" if "closed" in refused(client.session) else "",
}))
