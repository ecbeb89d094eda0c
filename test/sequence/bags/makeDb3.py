#!/usr/bin/python3
"""makeDb3.py DRIVE OUT.db3 [big]: the tables of rosbag2_storage_sqlite3 and CDR by hand; little- or big-endian."""
import os, sqlite3, struct, sys
from drive import Drive, RECEIVED_LATER

source, out, order = sys.argv[1], sys.argv[2], ">" if sys.argv[3:] == ["big"] else "<"
drive = Drive(source)


class Cdr:
    def __init__(self):
        self.bytes = b""

    def number(self, kind, *values):
        size = struct.calcsize(kind)
        for value in values:
            self.bytes += bytes(-len(self.bytes) % size) + struct.pack(order + kind, value)
        return self

    def text(self, text):
        self.number("I", len(text) + 1)
        self.bytes += text.encode() + b"\0"
        return self

    def blob(self, data):
        self.number("I", len(data))
        self.bytes += data
        return self

    def header(self, ns, frame):
        return self.number("i", ns // 10**9).number("I", ns % 10**9).text(frame)

    def message(self):
        return b"\0" + (b"\1" if order == "<" else b"\0") + b"\0\0" + self.bytes


if os.path.exists(out):
    os.remove(out)
database = sqlite3.connect(out)
database.executescript("""
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL,
                    offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES (3, 'humble');
""")
topics = {}


def write(topic, kind, ns, cdr):
    if topic not in topics:
        topics[topic] = len(topics) + 1
        database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (topics[topic], topic, kind))
    database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                     (topics[topic], ns + int(RECEIVED_LATER * 1e9), cdr.message()))


still = Cdr().number("I", len(drive.frames))
for parent, child, xyz, q in drive.frames:
    still.header(0, parent).text(child).number("d", *xyz, *q)
write("/tf_static", "tf2_msgs/msg/TFMessage", drive.twists[0][0], still)
for ns, v, w in drive.twists:
    write("/odom", "nav_msgs/msg/Odometry", ns, Cdr().header(ns, "odom").text("base_link")
          .number("d", *[0] * 6, 1, *[0] * 36, *v, *w, *[0] * 36))
for ns, png, _ in drive.images:
    write("/camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage", ns,
          Cdr().header(ns, "camera_optical").text("mono8; png compressed").blob(png))
c = drive.camera
write("/camera/camera_info", "sensor_msgs/msg/CameraInfo", drive.images[0][0],
      Cdr().header(drive.images[0][0], "camera_optical").number("I", c["height"], c["width"]).text("plumb_bob")
      .number("I", 5).number("d", *[0] * 5, *c["K"], *[0] * 9, *[0] * 12).number("I", *[0] * 6).number("B", 0))
database.commit()
database.execute("VACUUM")
