"""What canmatrix (Debian: python3-canmatrix) reads in a DBC, for tests to compare with what Knuckle meant.

    canmatrix_witness.py describe DBC OUT        one line a message, then one for each of its signals
    canmatrix_witness.py decode DBC CANDUMP OUT  one line a frame: the message's name, then SIGNAL=VALUE of each signal
    canmatrix_witness.py raw DBC CANDUMP OUT     the same with the numbers as they are in the frame, before scaling
    canmatrix_witness.py both DBC CANDUMP OUT    raw, and last the frame that it makes of these numbers, in hex

Cells are separated by tabs. Exit code 77: canmatrix is not installed.
"""

import sys

try:
    import canmatrix
    import canmatrix.formats
except ImportError:
    sys.exit(77)


def describe(matrix, out):
    for frame in matrix.frames:
        cells = ["message", frame.name, frame.arbitration_id.id, frame.size, ",".join(frame.transmitters)]
        cells += [float(frame.cycle_time), frame.comment or ""]
        print(*cells, sep="\t", file=out)
        for s in frame.signals:
            kind = "float" if s.is_float else "signed" if s.is_signed else "unsigned"
            order = "little" if s.is_little_endian else "big"
            values = ";".join(f"{raw}={name}" for raw, name in sorted(s.values.items()))
            cells = ["signal", s.name, kind, order, s.start_bit, s.size, float(s.factor), float(s.offset)]
            cells += [float(s.min), float(s.max), s.unit, ",".join(s.receivers), values, s.comment or ""]
            print(*cells, sep="\t", file=out)


def encode(frame, values):
    """Numbers that are none are left out: their bits would be others."""
    raw = {name: signal.raw_value for name, signal in values.items() if signal.raw_value == signal.raw_value}
    # encode() refuses frames with SG_MUL_VAL_; what it would call for them does not.
    return (frame.signals_to_bytes if frame.is_complex_multiplexed else frame.encode)(raw).hex()


def decode(matrix, log, out, shown, both=False):
    for line in log:
        identifier, data = line.split()[2].split("#")
        frame = matrix.frame_by_id(canmatrix.ArbitrationId(int(identifier, 16), extended=len(identifier) == 8))
        if frame is None:
            print("?", file=out)
            continue
        cells = [frame.name]
        if frame.signals:
            values = frame.decode(bytes.fromhex(data))
            cells += [f"{name}={shown(signal)!r}" for name, signal in values.items()]
            if both:
                cells.append(encode(frame, values))
        print(*cells, sep="\t", file=out)


def main(arguments):
    matrix = canmatrix.formats.loadp_flat(arguments[1])
    with open(arguments[-1], "w", encoding="utf-8") as out:
        if arguments[0] == "describe":
            describe(matrix, out)
        else:
            raw = arguments[0] != "decode"
            with open(arguments[2], encoding="utf-8") as log:
                decode(matrix, log, out, lambda s: s.raw_value if raw else float(s.phys_value), arguments[0] == "both")


main(sys.argv[1:])
