#!/usr/bin/env python3
"""Decodes the inertial messages of src/wire/inertial_message.rs; the standard library alone.

    python3 docs/inertial_message.py capture.bin      # a line of JSON for each message; - for standard input
"""

import json
import struct
import sys

FLAG, ESCAPE, TOGGLE = 0x7E, 0x7D, 0x20
RAD_PER_CODE = 2.0**-35
M_S_PER_CODE = 2.0**-27


def fcs(message):
    """CRC-16/IBM-SDLC bit by bit: polynomial 0x1021 reflected, initial 0xFFFF, inverted."""
    crc = 0xFFFF
    for byte in message:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0x8408 if crc & 1 else crc >> 1
    return crc ^ 0xFFFF


def messages(stream):
    """Yields each whole message between flags, without stuffing and check sum."""
    # Bytes before the first flag belong to no frame.
    for frame in stream.split(bytes([FLAG]))[1:]:
        if frame.endswith(bytes([ESCAPE])):
            continue
        bytes_of_it, escaped = bytearray(), False
        for byte in frame:
            if byte == ESCAPE and not escaped:
                escaped = True
                continue
            bytes_of_it.append(byte ^ TOGGLE if escaped else byte)
            escaped = False
        if len(bytes_of_it) > 2 and fcs(bytes_of_it[:-2]) == struct.unpack("<H", bytes_of_it[-2:])[0]:
            yield bytes(bytes_of_it[:-2])


def decode(message):
    """Returns a message as a dictionary; None where it is none of this version."""
    if message[:2] == b"\x01\x01" and len(message) == 36:
        counter, pulses, since, summary = struct.unpack("<HHIB", message[2:11])
        codes = struct.unpack("<6i", message[12:])
        return {
            "message": "increments",
            "counter": counter,
            "pulses": pulses,
            "since_pulse_ns": None if since == 0xFFFFFFFF else since,
            "summary": summary,
            "dtheta_codes": list(codes[:3]),
            "dvel_codes": list(codes[3:]),
            "dtheta_rad": [code * RAD_PER_CODE for code in codes[:3]],
            "dvel_m_s": [code * M_S_PER_CODE for code in codes[3:]],
        }
    if message[:2] == b"\x02\x01" and len(message) == 20:
        item, _, value, status, sequence, second = struct.unpack("<BBIIII", message[2:])
        return {
            "message": "control",
            "item": item,
            "value": value,
            "status": status,
            "sequence": sequence,
            "second": second,
        }
    return None


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    name = sys.argv[1]
    stream = sys.stdin.buffer.read() if name == "-" else open(name, "rb").read()
    for message in messages(stream):
        fields = decode(message)
        if fields is not None:
            print(json.dumps(fields))


if __name__ == "__main__":
    main()
