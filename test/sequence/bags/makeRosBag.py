#!/usr/bin/python3
"""makeRosBag.py DRIVE OUT.bag none|lz4|bz2 [raw|png]: with Debian's python3-rosbag."""
import sys
import genpy, rosbag
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu, JointState
from tf2_msgs.msg import TFMessage
from drive import Drive, RECEIVED_LATER

source, out, packing, kind = sys.argv[1], sys.argv[2], sys.argv[3], (sys.argv[4:] or ["raw"])[0]
drive = Drive(source)
with rosbag.Bag(out, "w", compression=packing, chunk_threshold=100 * 1024) as bag:
    def write(topic, message, ns):
        stamp = genpy.Time(ns // 10**9, ns % 10**9)
        if hasattr(message, "header"):
            message.header.stamp = stamp
        bag.write(topic, message, stamp + genpy.Duration.from_sec(RECEIVED_LATER))

    first = drive.twists[0][0]
    still = TFMessage()
    for parent, child, xyz, q in drive.frames:
        t = TransformStamped()
        t.header.frame_id, t.child_frame_id = parent, child
        t.transform.translation.x, t.transform.translation.y, t.transform.translation.z = xyz
        r = t.transform.rotation
        r.x, r.y, r.z, r.w = q
        still.transforms.append(t)
    write("/tf_static", still, first)
    rows = [(ns, "odometry", v, w) for ns, v, w in drive.twists] + [(ns, "image", p, g) for ns, p, g in drive.images]
    for ns, what, a, b in sorted(rows, key=lambda row: row[0]):
        if what == "odometry":
            m = Odometry()
            m.header.frame_id, m.child_frame_id = "odom", "base_link"
            m.pose.pose.orientation.w = 1
            m.twist.twist.linear.x, m.twist.twist.linear.y, m.twist.twist.linear.z = a
            m.twist.twist.angular.x, m.twist.twist.angular.y, m.twist.twist.angular.z = b
            write("/odom", m, ns)
            continue
        width, height, levels = b
        if kind == "raw":
            m = Image(height=height, width=width, encoding="mono8", step=width, data=levels)
        else:
            m = CompressedImage(format="png", data=a)
        m.header.frame_id = "camera_optical"
        write("/camera/image_raw" + ("" if kind == "raw" else "/compressed"), m, ns)
        info = CameraInfo(width=drive.camera["width"], height=drive.camera["height"], distortion_model="plumb_bob",
                          D=[0.0] * 5, K=drive.camera["K"])
        info.header.frame_id = "camera_optical"
        write("/camera/camera_info", info, ns)
        imu = Imu()
        imu.header.frame_id = "imu"
        write("/imu", imu, ns)
        write("/joint_states", JointState(name=["left", "right"], position=[0, 0], velocity=[1, 1]), ns)
