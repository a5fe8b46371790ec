"""How fast python-can with cantools decodes a candump log: frames per second on standard output.

python tests/python/decode_rival.py guideblock.dbc run.log
"""

import sys
import time

import can
import cantools

database = cantools.database.load_file(sys.argv[1])
start = time.perf_counter()
frames = 0
for message in can.CanutilsLogReader(sys.argv[2]):
    database.decode_message(message.arbitration_id, message.data, decode_choices=False)
    frames += 1
print(frames / (time.perf_counter() - start))
