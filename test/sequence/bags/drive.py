"""A small sequence as the messages that a robot would have recorded of it: the base instead of the camera."""
import csv, math, os, struct, zlib

RECEIVED_LATER = 0.004  # s


def png_levels(path):
    """Width, height and gray levels of an 8-bit gray PNG."""
    data, place, packed = open(path, "rb").read(), 8, b""
    while place < len(data):
        size, kind = struct.unpack_from(">I4s", data, place)
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack_from(">IIBB", data, place + 8)
            assert (depth, colour) == (8, 0)
        if kind == b"IDAT":
            packed += data[place + 8:place + 8 + size]
        place += 12 + size
    raw, rows, before = zlib.decompress(packed), [], bytes(width)
    for v in range(height):
        kind, line = raw[v * (width + 1)], bytearray(raw[v * (width + 1) + 1:(v + 1) * (width + 1)])
        for u in range(width):
            a, b, c = (line[u - 1] if u else 0), before[u], (before[u - 1] if u else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            line[u] = (line[u] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        before = bytes(line)
        rows.append(before)
    return width, height, b"".join(rows)


def rotation(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    a, b, c, d, e, f = (math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw))
    return [[e * c, e * d * b - f * a, e * d * a + f * b],
            [f * c, f * d * b + e * a, f * d * a - e * b],
            [-d, c * b, c * a]]


def times(A, B):
    return [[sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(A, v):
    return [sum(A[i][k] * v[k] for k in range(3)) for i in range(3)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def quaternion(roll, pitch, yaw):
    """x, y, z, w."""
    a, b, c, d, e, f = (math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2),
                        math.cos(yaw / 2), math.sin(yaw / 2))
    return [b * c * e - a * d * f, a * d * e + b * c * f, a * c * f - b * d * e, a * c * e + b * d * f]


# base_link -> camera_link: ahead, aside and above, tilted; camera_link -> camera_optical as ROS has it.
MOUNT = {"xyz": [0.31, -0.07, 0.22], "rpy": [0.1, 0.35, -0.2]}
OPTICAL = {"xyz": [0.0, 0.015, 0.0], "rpy": [-math.pi / 2, 0.0, -math.pi / 2]}


def camera_in_base():
    R = rotation(*MOUNT["rpy"])
    t = [a + b for a, b in zip(MOUNT["xyz"], apply(R, OPTICAL["xyz"]))]
    return times(R, rotation(*OPTICAL["rpy"])), t


class Drive:
    """Times are whole nanoseconds."""

    def __init__(self, folder):
        nanoseconds = lambda text: int(text.replace(".", ""))
        self.images = []
        for line in open(os.path.join(folder, "rgb.txt")):
            if not line.startswith("#"):
                time, name = line.split()
                file = os.path.join(folder, name)
                self.images.append((nanoseconds(time), open(file, "rb").read(), png_levels(file)))
        R, t = camera_in_base()
        self.twists = []  # of the base
        for row in csv.DictReader(open(os.path.join(folder, "twist.csv"))):
            v, w = ([float(row[k]) for k in names] for names in (("vx", "vy", "vz"), ("wx", "wy", "wz")))
            base_w = apply(R, w)
            base_v = [a - b for a, b in zip(apply(R, v), cross(base_w, t))]
            self.twists.append((nanoseconds(row["timestamp"]), base_v, base_w))
        self.camera = {"width": 200, "height": 150, "K": [180.0, 0, 99.5, 0, 180.0, 74.5, 0, 0, 1]}
        self.frames = [("base_link", "camera_link", MOUNT["xyz"], quaternion(*MOUNT["rpy"])),
                       ("camera_link", "camera_optical", OPTICAL["xyz"], quaternion(*OPTICAL["rpy"]))]
