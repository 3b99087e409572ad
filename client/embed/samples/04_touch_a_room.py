"""The Python form of 01_touch_a_room.c. PYTHONPATH names the folder that contains the package `tandem`.

    python3 04_touch_a_room.py 127.0.0.1:47800
"""

import sys

import tandem

# The start of the block joins the room and starts the 1 kHz loop. Its end ramps the force to zero and leaves the room.
with tandem.Client(server=sys.argv[1], user_name="sample", is_insecure=True) as client:
    client.grab()
    for event in client.events(timeout_s=1):  # ends when there is no event for 1 s
        if event.kind == tandem.EVENT_GRABBED:
            print("grabbed body", event.body)
    ticks = client.read_ticks()
    largest_n = max(force[2] for force in ticks.force_n.tolist())  # or numpy.asarray(ticks.force_n), without a copy
    print(f"{len(ticks)} ticks, force at most {largest_n:.2f} N upwards")
    held = client.snapshot().held_body
sys.exit(0 if held else 1)
