"""The bus contract against python-can and cantools, which know nothing of can-wire but its DBC.

1. Rust -> DBC:  frames of random content, encoded by can-wire, decoded by cantools: every raw integer and every
   physical value must be what the generator chose.
2. DBC -> Rust:  random physical values and named codes, encoded by cantools, CRC computed here, decoded by can-wire.
3. Rejections:   every flipped bit, foreign identifiers, wrong lengths and repeated counters, each for its own reason.

Candump text is written and read by python-can. Run from anywhere: python tests/python/dbc_cross_check.py [FRAMES]
"""

import random
import subprocess
import sys
import tempfile
import time
from decimal import Decimal
from pathlib import Path

import can
import cantools

ROOT = Path(__file__).absolute().parents[2]
DATABASE = cantools.database.load_file(ROOT / "can-wire" / "guideblock.dbc", strict=True)
# service and bursts have state machines of their own and no counter: their frames are checked by can-wire's tests
CYCLIC = [definition for definition in DATABASE.messages if definition.cycle_time]
SEED = 20261121

# CiA 301 emergency code and error register of each reason, in the order of their urgency: from the contract, not the code
EMERGENCY = {
    "not_calibrated": (0x6300, 0x81),
    "force_at_rail": (0x5010, 0x81),
    "force_stuck": (0x5011, 0x81),
    "encoder_stuck": (0x5012, 0x81),
    "temperature_missing": (0x5013, 0x09),
    "temperature_out_of_range": (0x4200, 0x09),
    "samples_lost": (0x6100, 0x81),
    "no_motion": (0, 0),
    "reversing": (0, 0),
    "accelerating": (0, 0),
    "settling": (0, 0),
    "speed_out_of_range": (0xFF0C, 0x81),
    "load_out_of_range": (0xFF0D, 0x81),
    "force_assists": (0x9000, 0x81),
    "stale": (0x6101, 0x81),
}

# signal of the DBC -> field of can-wire, and one DBC unit in SI
NUMBERS = {
    "strength": ("strength", "1"),
    "share": ("share", "0.01"),
    "since": ("since_s", "1"),
    "preload": ("preload_n", "1"),
    "sigma": ("sigma_n", "1"),
    "drag_force": ("drag_force_n", "1"),
    "speed": ("speed_m_s", "0.001"),
    "temperature": ("temperature_degc", "1"),
    "time": ("time_us", "1"),
    "amplitude": ("amplitude_n", "1"),
    "phase": ("phase_rad", "1"),
    "wavelength": ("wavelength_m", "0.001"),
}


def crc8_autosar(identifier: int, payload: bytes) -> int:
    """Polynomial 0x2F, start and final XOR 0xFF, bit by bit, over the identifier (low byte first) and the payload."""
    crc = 0xFF
    for byte in identifier.to_bytes(2, "little") + payload:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1) ^ (0x12F if crc & 0x80 else 0)
    return crc ^ 0xFF


def rust(example: str, *arguments: str, stdin=None) -> str:
    command = ["cargo", "run", "--quiet", "--profile", "desk", "-p", "can-wire", "--example", example, "--", *arguments]
    return subprocess.run(command, cwd=ROOT, stdin=stdin, stdout=subprocess.PIPE, text=True, check=True).stdout


def read_by_rust(messages: list[can.Message]) -> list[list[str]]:
    """What can-wire makes of the frames, one list of fields each."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "frames.log"
        with can.CanutilsLogWriter(log) as writer:
            for message in messages:
                writer.on_message_received(message)
        with open(log, encoding="ascii") as entries:
            lines = rust("read_frames", stdin=entries).splitlines()
    assert len(lines) == len(messages), f"{len(messages)} frames sent, {len(lines)} read"
    return [line.split(",") for line in lines]


def frame(identifier: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False, timestamp=0.0)


class Differences:
    """Counts, and shows the first few."""

    def __init__(self) -> None:
        self.count = 0

    def check(self, found, expected, where: str) -> None:
        if found != expected:
            self.count += 1
            if self.count <= 10:
                print(f"  {where}: {found!r} instead of {expected!r}")


def rust_to_dbc(frames: int, differences: Differences) -> None:
    lines = rust("random_frames", str(frames), str(SEED)).splitlines()
    assert len(lines) == frames
    entries, expectations = zip(*(line.split(",", 1) for line in lines))
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "frames.log"
        log.write_text("\n".join(entries) + "\n", encoding="ascii")
        with can.CanutilsLogReader(log) as reader:
            messages = list(reader)
    assert len(messages) == frames, f"python-can reads {len(messages)} of {frames} log entries"
    seen = {}
    for message, expectation in zip(messages, expectations):
        definition = DATABASE.get_message_by_frame_id(message.arbitration_id)
        raws = definition.decode(message.data, decode_choices=False, scaling=False)
        physicals = definition.decode(message.data, decode_choices=False, scaling=True)
        words = expectation.split(",")
        expected = {name: (int(raw), physical) for name, raw, physical in zip(words[::3], words[1::3], words[2::3])}
        expected["crc"] = (crc8_autosar(message.arbitration_id, message.data[:7]), "")
        differences.check(set(raws), set(expected), f"signals of {definition.name}")
        for name, (raw, physical) in expected.items():
            signal = definition.get_signal_by_name(name)
            where = f"{definition.name}.{name} of {message.data.hex()}"
            differences.check(raws.get(name), raw, where)
            if physical:
                # cantools scales in binary floating point; its nearest decimal of our resolution must be ours
                decimal = Decimal(physical)
                places = max(0, -decimal.as_tuple().exponent)
                differences.check(Decimal(f"{physicals[name]:.{places}f}"), decimal, where)
            elif name != "crc":
                differences.check(str((signal.choices or {}).get(raw)), "not available", where)
        seen[definition.name] = seen.get(definition.name, 0) + 1
    assert len(seen) == len(CYCLIC) == len(DATABASE.messages) - 4, seen
    print("  " + ", ".join(f"{name} {count}" for name, count in sorted(seen.items())))


def random_values(definition, rng: random.Random) -> dict[str, int]:
    """Raw values that a block could send, every signal anywhere in its range; the counter and the CRC are left out."""
    raws = {}
    for signal in definition.signals:
        if signal.name in ("counter", "crc"):
            continue
        scale = Decimal(str(signal.scale))
        low, high = (int(Decimal(str(limit)) / scale) for limit in (signal.minimum, signal.maximum))
        named = {code: str(name) for code, name in (signal.choices or {}).items()}
        if named and "not available" not in named.values():
            raws[signal.name] = rng.choice(list(named))
        elif named and rng.randrange(4) == 0:
            raws[signal.name] = next(iter(named))
        else:
            raws[signal.name] = rng.choice((low, high, rng.randint(low, high), rng.randint(low, high)))
    # what hangs together in the contract
    if "quality" in raws:
        trusted = raws["quality"] == 0
        for name in ("preload", "sigma"):
            raws[name] = raws[name] % 0xFFFC if trusted else 0xFFFF
    if "phase" in raws and (raws["amplitude"] == 0xFFFF) != (raws["phase"] == -0x8000):
        raws["amplitude"], raws["phase"] = 0xFFFF, -0x8000
    if "axis" in raws:
        judged = raws["axis"] != 0
        for name in ("strength", "share"):
            raws[name] = raws[name] % 0xFFFC if judged else 0xFFFF
    if "error_code" in raws:
        thin = rng.getrandbits(15) & rng.getrandbits(15) & rng.getrandbits(15)
        for bit, name in enumerate(EMERGENCY):
            raws[name] = thin >> bit & 1
        held = [EMERGENCY[name] for name in EMERGENCY if raws[name]]
        raws["error_code"] = next((code for code, _ in held if code), 0)
        raws["error_register"] = 0
        for _, bits in held:
            raws["error_register"] |= bits
    return raws


def as_a_user_writes(signal, raw: int):
    """A named code by its name, a number in its unit."""
    if signal.choices and raw in signal.choices:
        return str(signal.choices[raw])
    return float(raw * Decimal(str(signal.scale)))


def expected_of_rust(definition, raws: dict[str, int], counter: int) -> dict[str, str | Decimal]:
    fields: dict[str, str | Decimal] = {"counter": Decimal(counter)}
    if "error_code" in raws:
        fields["reasons"] = " ".join(name.replace("_", "-") for name in EMERGENCY if raws[name])
    for name, raw in raws.items():
        signal = definition.get_signal_by_name(name)
        named = str((signal.choices or {}).get(raw, ""))
        if name in NUMBERS:
            field, unit = NUMBERS[name]
            fields[field] = "" if named else raw * Decimal(str(signal.scale)) * Decimal(unit)
        elif name == "error_code" or not signal.choices:
            fields[name] = Decimal(raw)
        else:
            fields[name] = named
    for name in EMERGENCY:
        fields.pop(name, None)
    return fields


def dbc_to_rust(frames: int, differences: Differences) -> None:
    rng = random.Random(SEED)
    counters = {definition.frame_id: 0 for definition in CYCLIC}
    messages, expectations = [], []
    for _ in range(frames):
        definition = rng.choice(CYCLIC)
        counter = counters[definition.frame_id]
        # some frames are lost on the way, as on a bus
        counters[definition.frame_id] = (counter + rng.choice((1, 1, 1, 2, 15))) % 16
        raws = random_values(definition, rng)
        values = {name: as_a_user_writes(definition.get_signal_by_name(name), raw) for name, raw in raws.items()}
        data = bytearray(definition.encode(values | {"counter": counter, "crc": 0}, strict=True))
        data[7] = crc8_autosar(definition.frame_id, data[:7])
        messages.append(frame(definition.frame_id, bytes(data)))
        expectations.append((definition, raws, counter))
    for message, words, (definition, raws, counter) in zip(messages, read_by_rust(messages), expectations):
        where = f"{definition.name} {message.data.hex()}"
        expected = expected_of_rust(definition, raws, counter)
        found = dict(zip(words[::2], words[1::2]))
        differences.check(set(found), set(expected), where)
        for name, value in expected.items():
            text = found.get(name, "missing")
            if isinstance(value, Decimal):
                differences.check(Decimal(text) if text not in ("", "missing") else text, value, f"{where} {name}")
            else:
                differences.check(text, value, f"{where} {name}")


def rejections(differences: Differences) -> int:
    rng = random.Random(SEED)
    bases = {definition.frame_id & ~0x7F for definition in CYCLIC}
    messages, expected = [], []

    def send(identifier: int, data: bytes, reason: str) -> None:
        messages.append(frame(identifier, data))
        expected.append(reason)

    for definition in CYCLIC:
        values = random_values(definition, rng)
        data = bytearray(definition.encode(values | {"counter": 0, "crc": 0}, scaling=False, strict=False))
        data[7] = crc8_autosar(definition.frame_id, data[:7])
        good = bytes(data)
        send(definition.frame_id, good, "taken")
        for bit in range(64):
            flipped = bytearray(good)
            flipped[bit // 8] ^= 1 << bit % 8
            send(definition.frame_id, bytes(flipped), "crc")
        for bit in range(11):
            wrong = definition.frame_id ^ 1 << bit
            ours = wrong & ~0x7F in bases
            send(wrong, good, "unknown-identifier" if not ours else "crc" if wrong & 0x7F else "node-range")
        for other in CYCLIC:
            if other is not definition:
                send(other.frame_id, good, "crc")
        for length in range(8):
            send(definition.frame_id, good[:length], "length")
        send(definition.frame_id, good, "repeated-counter")
        send(0x123, good, "unknown-identifier")
    for message, words, reason in zip(messages, read_by_rust(messages), expected):
        found = words[1] if words[0] == "rejected" else "taken"
        differences.check(found, reason, f"{message.arbitration_id:03X}#{message.data.hex()}")
    return len(messages)


def main() -> int:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    differences = Differences()
    start = time.monotonic()
    rust_to_dbc(frames, differences)
    print(f"can-wire -> cantools: {frames} frames, {differences.count} differences, {time.monotonic() - start:.0f} s")
    before, start = differences.count, time.monotonic()
    dbc_to_rust(frames, differences)
    print(f"cantools -> can-wire: {frames} frames, {differences.count - before} differences, {time.monotonic() - start:.0f} s")
    before = differences.count
    sent = rejections(differences)
    print(f"rejections: {sent} frames, {differences.count - before} differences")
    return 1 if differences.count else 0


if __name__ == "__main__":
    sys.exit(main())
