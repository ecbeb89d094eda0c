#!/usr/bin/python3
"""makeBags.py: writes the small bags of seeds/mcap, seeds/rosbag and seeds/db3 anew (lz4, zstd on the path)."""
import bz2, os, sqlite3, struct, subprocess

seeds = os.path.join(os.path.dirname(os.path.abspath(__file__)), "seeds")
WIDTH, HEIGHT = 8, 6
LEVELS = bytes((u * 20 + v * 10) % 256 for v in range(HEIGHT) for u in range(WIDTH))
K = [10, 0, 3.5, 0, 11, 2.5, 0, 0, 1]
I = [1, 0, 0, 0, 1, 0, 0, 0, 1]
P = [10, 0, 3.5, 0, 0, 11, 2.5, 0, 0, 0, 1, 0]
MD5 = {"sensor_msgs/Image": "060021388200f6f0f447d0fcd9c64743", "sensor_msgs/CameraInfo": "c9a58c1b0b154e0e6da7578cb991d214",
       "geometry_msgs/TwistStamped": "98d34b0043a2093cf9d9345ab6eef12e", "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec"}


class Message:
    """CDR (little-endian) or, without padding and terminating zeros, what ROS 1 writes."""

    def __init__(self, is_cdr):
        self.bytes, self.is_cdr = b"", is_cdr

    def number(self, kind, *values):
        size = struct.calcsize(kind)
        for value in values:
            self.bytes += (bytes(-len(self.bytes) % size) if self.is_cdr else b"") + struct.pack("<" + kind, value)
        return self

    def text(self, text):
        self.number("I", len(text) + self.is_cdr)
        self.bytes += text.encode() + bytes(self.is_cdr)
        return self

    def blob(self, data):
        self.number("I", len(data))
        self.bytes += data
        return self

    def header(self, ms, frame):
        if not self.is_cdr:
            self.number("I", 0)
        return self.number("I", 100 + ms // 1000, ms % 1000 * 1000000).text(frame)

    def whole(self):
        return (b"\0\1\0\0" if self.is_cdr else b"") + self.bytes


def messages(is_cdr):
    """Topic, type, milliseconds, bytes."""
    new = lambda: Message(is_cdr)
    still = new().number("I", 1).header(0, "base").text("camera").number("d", .1, 0, .2, 0, 0, 0, 1)
    yield "/tf_static", "tf2_msgs/TFMessage", 0, still.whole()
    info = new().header(0, "camera").number("I", HEIGHT, WIDTH).text("plumb_bob").number("I", 5).number("d", *[0] * 5)
    yield "/info", "sensor_msgs/CameraInfo", 0, info.number("d", *K, *I, *P).number("I", *[0] * 6).number("B", 0).whole()
    for i in range(4):
        yield ("/twist", "geometry_msgs/TwistStamped", 20 * i,
               new().header(20 * i, "base").number("d", .1, 0, .02 * i, 0, .03, 0).whole())
    for i in range(2):
        yield ("/image", "sensor_msgs/Image", 30 * i, new().header(30 * i, "camera").number("I", HEIGHT, WIDTH).text("mono8")
               .number("B", 0).number("I", WIDTH).blob(LEVELS).whole())


def through(*command):
    return lambda data: subprocess.run(command, input=data, stdout=subprocess.PIPE, check=True).stdout


def ros2(kind):
    return kind.replace("/", "/msg/")


def mcap(packing, pack):
    string = lambda text: struct.pack("<I", len(text)) + text.encode()
    record = lambda op, content: struct.pack("<BQ", op, len(content)) + content
    ids, records = {}, b""
    for topic, kind, ms, data in messages(True):
        if topic not in ids:
            n = ids[topic] = len(ids) + 1
            records += record(3, struct.pack("<H", n) + string(ros2(kind)) + string("ros2msg") + string("#"))
            records += record(4, struct.pack("<HH", n, n) + string(topic) + string("cdr") + struct.pack("<I", 0))
        ns = 100 * 10**9 + ms * 10**6
        records += record(5, struct.pack("<HIQQ", ids[topic], 0, ns, ns) + data)
    if packing is not None:
        packed = pack(records)
        records = record(6, struct.pack("<QQQI", 100 * 10**9, 101 * 10**9, len(records), 0) + string(packing) +
                         struct.pack("<Q", len(packed)) + packed)
    magic = b"\x89MCAP0\r\n"
    return magic + record(1, string("ros2") + string("")) + records + record(2, bytes(20)) + magic


def rosbag(packing, pack):
    fields = lambda **all: b"".join(struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
                                    for name, value in all.items())
    record = lambda head, data: struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data
    u32, u64 = (lambda n: struct.pack("<I", n)), (lambda n: struct.pack("<Q", n))
    ids, connections, inside = {}, [], b""
    for topic, kind, ms, data in messages(False):
        if topic not in ids:
            ids[topic] = len(ids)
            connections.append(record(fields(conn=u32(ids[topic]), op=b"\7", topic=topic.encode()),
                                      fields(topic=topic.encode(), type=kind.encode(), md5sum=MD5[kind].encode(),
                                             message_definition=b"#")))
            inside += connections[-1]
        inside += record(fields(conn=u32(ids[topic]), op=b"\2", time=u32(100) + u32(ms * 10**6)), data)
    magic = b"#ROSBAG V2.0\n"
    head = lambda at: record(fields(chunk_count=u32(1), conn_count=u32(len(ids)), index_pos=u64(at), op=b"\3"), b"    ")
    chunk = record(fields(compression=packing.encode(), op=b"\5", size=u32(len(inside))), pack(inside))
    place = len(magic) + len(head(0))
    info = record(fields(chunk_pos=u64(place), count=u32(len(ids)), end_time=u32(101) + u32(0), op=b"\6",
                         start_time=u32(100) + u32(0), ver=u32(1)), b"".join(u32(n) + u32(1) for n in ids.values()))
    return magic + head(place + len(chunk)) + chunk + b"".join(connections) + info


def db3(path):
    if os.path.exists(path):
        os.remove(path)
    database = sqlite3.connect(path)
    database.executescript("""
    PRAGMA page_size = 512;
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                        serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
    """)
    ids = {}
    for topic, kind, ms, data in messages(True):
        if topic not in ids:
            ids[topic] = len(ids) + 1
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (ids[topic], topic, ros2(kind)))
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                         (ids[topic], 100 * 10**9 + ms * 10**6, data))
    database.commit()
    database.execute("VACUUM")


def write(name, data):
    with open(os.path.join(seeds, name), "wb") as file:
        file.write(data)


lz4, zstd = through("lz4", "-c", "-z"), through("zstd", "-c", "--content-size")
write("mcap/plain", mcap(None, None))
write("mcap/lz4", mcap("lz4", lz4))
write("mcap/zstd", mcap("zstd", zstd))
write("rosbag/plain", rosbag("none", lambda data: data))
write("rosbag/bz2", rosbag("bz2", bz2.compress))
write("rosbag/lz4", rosbag("lz4", lz4))
db3(os.path.join(seeds, "db3/small"))
