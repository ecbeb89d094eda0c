"""The nodes against the tool, with a roscore on loopback.

    /usr/bin/python3 ros_test.py TOOL DATA NODES WORK

1. A scenario's recording as a bag, with the odometry of a base on which the camera sits tilted and aside (by
   /tf_static), is played: `observe` gives the estimates that `depthservo replay` gives.
2. `servo` is taught a goal by its service and drives a simulated robot, a node, back to it.
3. Nodes are killed while the robot moves: it stops.
"""

import atexit
import csv
import json
import math
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import zlib
from importlib.machinery import SourceFileLoader

TOOL, DATA, NODES, WORK = sys.argv[1:5]
HERE = os.path.dirname(os.path.abspath(__file__))
with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    PORT = free.getsockname()[1]
os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{PORT}", ROS_IP="127.0.0.1", ROS_HOME=f"{WORK}/ros",
                  ROSCONSOLE_STDOUT_LINE_BUFFERED="1")

import numpy as np  # noqa: E402
import rosbag  # noqa: E402
import rospy  # noqa: E402
from geometry_msgs.msg import TransformStamped, Twist  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from depthservo_ros.msg import PointDepth, PointDepths  # noqa: E402

bridge = SourceFileLoader("robot_bridge", f"{HERE}/../scripts/robot_bridge").load_module()
STATUS = {PointDepth.CONVERGING: "converging", PointDepth.VALID: "valid", PointDepth.UNEXCITED: "unexcited",
          PointDepth.COASTING: "coasting", PointDepth.REJECTED: "rejected", PointDepth.LOST: "lost"}
TOPICS = ("image:=/camera/image_raw", "camera_info:=/camera/camera_info", "odometry:=/odom")
running = []


def start(*command, name):
    log = open(f"{WORK}/{name}.log", "w")
    process = subprocess.Popen([str(word) for word in command], stdout=log, stderr=subprocess.STDOUT,
                               stdin=subprocess.DEVNULL)
    running.append(process)
    return process


def end(process, how=signal.SIGTERM, wait=15):
    process.send_signal(how)
    process.wait(wait)


@atexit.register
def end_all():
    for process in running:
        if process.poll() is None:
            process.kill()


def wait_until(condition, seconds, what):
    limit = time.time() + seconds
    while not condition():
        assert time.time() < limit, f"{what}: not within {seconds} s"
        time.sleep(0.02)


def set_parameters(node, **values):
    for key, value in values.items():
        rospy.set_param(f"/{node}/{key}", value)


def tool(*arguments):
    return subprocess.run([TOOL, *arguments], check=True, capture_output=True, text=True)


def gray_png(path):
    """Pixels of a PNG of gray levels, 8 bit."""
    data, at, packed = open(path, "rb").read(), 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
            assert (depth, colour) == (8, 0)
        packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    raw, rows, above = zlib.decompress(packed), [], np.zeros(width, np.uint8)
    for y in range(height):
        kind, line = raw[y * (width + 1)], raw[y * (width + 1) + 1:(y + 1) * (width + 1)]
        if kind in (0, 2):
            row = np.frombuffer(line, np.uint8) + (above if kind == 2 else np.uint8(0))
        elif kind == 1:
            row = np.cumsum(np.frombuffer(line, np.uint8), dtype=np.uint32).astype(np.uint8)
        else:
            row = np.zeros(width, np.uint8)
            for x in range(width):
                a, b, c = (int(row[x - 1]) if x else 0), int(above[x]), (int(above[x - 1]) if x else 0)
                p = a + b - c
                paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                row[x] = (line[x] + ((a + b) // 2 if kind == 3 else paeth)) & 255
        rows.append(row.tobytes())
        above = row
    return width, height, b"".join(rows)


# 1. A bag

START = 1000  # s: ROS has no time 0
CAMERA_IN_BASE = [0.2, -0.1, 0.4, -1.9, 0.05, -1.5]


def record():
    """A recording whose times begin at START, without the section that says how to replay it."""
    folder = f"{WORK}/sequence"
    tool("record", f"{DATA}/scenarios/unicycle-4dots-noise.yaml", folder, "--set", "duration=3", "--set",
         "expect=null")
    for name in os.listdir(folder):
        if not name.endswith((".txt", ".csv")):
            continue
        lines = open(f"{folder}/{name}").read().splitlines()
        with open(f"{folder}/{name}", "w") as out:
            for line in lines:
                number = re.match(r"\d+(?=\.)", line)
                out.write((str(int(number.group()) + START) + line[number.end():] if number else line) + "\n")
    settings = open(f"{folder}/sequence.yaml").read()
    with open(f"{folder}/sequence.yaml", "w") as out:
        out.write(re.sub(r"(?ms)^replay:\n(?:  .*\n)*", "", settings))
    return folder


def write_bag(folder, path):
    R, p = bridge.rotation(*CAMERA_IN_BASE[3:]), np.array(CAMERA_IN_BASE[:3])
    fixed = TransformStamped()
    fixed.header.frame_id, fixed.child_frame_id = "base_link", "camera_optical_frame"
    t, q = fixed.transform.translation, fixed.transform.rotation
    t.x, t.y, t.z = p
    q.w = math.sqrt(1 + np.trace(R)) / 2
    q.x, q.y, q.z = (R[2, 1] - R[1, 2]) / (4 * q.w), (R[0, 2] - R[2, 0]) / (4 * q.w), (R[1, 0] - R[0, 1]) / (4 * q.w)
    with rosbag.Bag(path, "w") as bag:
        before = rospy.Time(START - 3)
        bag.write("/tf_static", TFMessage([fixed]), before)
        for k in range(60):  # the node starts when tf is there
            now = before + rospy.Duration(k / 20)
            bag.write("/camera/camera_info", bridge.camera_info(now, 640, 480, 600.0), now)
        for line in open(f"{folder}/twist.csv").read().splitlines()[1:]:
            fields = line.split(",")
            stamp = bridge.stamp_of(fields[0])
            v, w = bridge.base_twist(np.array([float(f) for f in fields[1:]]), R, p)
            bag.write("/odom", bridge.odometry(stamp, v, w), stamp)
        for line in open(f"{folder}/rgb.txt").read().splitlines():
            if line.startswith("#"):
                continue
            time_s, file = line.split()
            stamp = bridge.stamp_of(time_s)
            bag.write("/camera/image_raw", bridge.gray_image(stamp, *gray_png(f"{folder}/{file}")), stamp)


def test_playback():
    folder = record()
    tool("replay", folder, "--tracker", "dots", "--estimator", "filter", "--prior", "3", "--pixel-noise", "0.5",
         "--out", f"{WORK}/replayed")
    write_bag(folder, f"{WORK}/bag.bag")
    heard = []
    subscriber = rospy.Subscriber("/depths", PointDepths, heard.append, queue_size=None)
    set_parameters("observe", tracker="dots", estimator="filter", initial=3.0, pixelNoise_px=0.5, rows="hold",
                   target=f"{folder}/sequence.yaml", playback=True, tf_wait=30.0)
    node = start(f"{NODES}/observe", *TOPICS, name="observe")
    wait_until(lambda: subscriber.get_num_connections() > 0, 20, "observe starts")
    played = start("/usr/lib/rosbag/play", "--quiet", "-d", "1", f"{WORK}/bag.bag", name="play")
    played.wait(60)
    images = len(open(f"{folder}/rgb.txt").read().split("\n")) - 1
    images -= open(f"{folder}/rgb.txt").read().count("#")
    wait_until(lambda: len(heard) >= images, 30, f"{images} images observed")
    end(node, signal.SIGINT)
    subscriber.unregister()

    rows = list(csv.DictReader(open(f"{WORK}/replayed/features.csv")))
    points = [(m.header.stamp.to_sec(), point) for m in heard for point in m.points]
    assert len(points) == len(rows), (len(points), len(rows))
    worst = 0
    for (time_s, point), row in zip(points, rows):
        assert abs(time_s - float(row["timestamp"])) < 1e-8 and point.id == int(row["id"])
        assert STATUS[point.status] == row["status"], (time_s, point.id)
        for mine, theirs in ((point.z, row["Z"]), (point.sigma_z, row["sigma_Z"]), (point.u, row["u"]),
                             (point.v, row["v"])):
            worst = max(worst, abs(mine / float(theirs) - 1))
    assert worst < 1e-9, worst
    print(f"playback: {len(heard)} images, {len(points)} depths as in replay, to {worst:.1e}")


# 2. and 3. A robot

MOUNT = [0.07, 0.02, 0.13, -math.pi / 2, 0, -math.pi / 2]  # of data/servo/dots.yaml
GOAL = "{x: -1, y: 0, theta: 0}"


class Robot:
    def __init__(self, name, initial, duration=60):
        self.pipes = [f"{WORK}/{name}.{kind}" for kind in ("images", "twist", "command")]
        self.log = f"{WORK}/{name}.csv"
        self.json = open(f"{WORK}/{name}.json", "w+")
        self.process = subprocess.Popen(
            [TOOL, "robot", f"{DATA}/servo/dots.yaml", "--set", f"robot.initial={initial}", "--set",
             f"duration={duration}", "--set", "depth.errors=typical", "--json", "--log", self.log, "--images",
             self.pipes[0], "--twist", self.pipes[1], "--command", self.pipes[2]],
            stdout=self.json, stderr=subprocess.DEVNULL)
        running.append(self.process)
        wait_until(lambda: all(os.path.exists(pipe) for pipe in self.pipes), 20, "the robot's pipes")
        self.bridge = start("/usr/bin/python3", f"{HERE}/../scripts/robot_bridge", *self.pipes,
                            f"_camera_in_base:={MOUNT}", "_focal:=600.0", f"__name:=robot_{name}",
                            name=f"bridge-{name}")

    def rows(self):
        lines = open(self.log).read().split("\n")[:-1]
        return [dict(zip(lines[0].split(","), line.split(","))) for line in lines[1:]]

    def speed(self):
        rows = self.rows()
        return abs(float(rows[-1]["v"])) if rows else 0

    def report(self):
        self.process.wait(20)
        self.json.seek(0)
        return json.load(self.json)


def start_servo(name):
    """With ages that a loaded machine can keep."""
    set_parameters(f"servo_{name}", tracker="dots", initial=1.0, goal=f"{WORK}/goal", camera_in_base=MOUNT,
                   robot={"type": "unicycle", "camera_offset": [0.07, 0.02, 0.13]}, control={"tolerance": 2.0},
                   safety={"image_age": 0.5, "odometry_age": 0.5, "overrun": 0.5, "contradiction": 0.3})
    return start(f"{NODES}/servo", *TOPICS, f"__name:=servo_{name}", name=f"servo-{name}")


def call(service, kind, *arguments):
    rospy.wait_for_service(service, 20)
    return rospy.ServiceProxy(service, kind)(*arguments)


def test_servo():
    commands, outcomes = [], []
    rospy.Subscriber("/cmd_vel", Twist, lambda m: commands.append((time.time(), m.linear.x, m.angular.z)))
    rospy.Subscriber("/outcome", String, lambda m: outcomes.append(m.data))

    node = start_servo("first")
    at_goal = Robot("at_goal", GOAL)
    wait_until(lambda: call("/servo_first/teach", Trigger).success, 30, "the goal is taught")
    assert not call("/servo_first/teach", Trigger).success, "a goal is not overwritten"
    end(at_goal.bridge)
    end(at_goal.process)

    robot = Robot("away", "{x: -1.8, y: 0.05, theta: 0}")
    time.sleep(1)
    assert not any(v for _, v, _ in commands), "it does not move before it is enabled"
    call("/servo_first/enable", SetBool, True)
    wait_until(lambda: outcomes, 60, "an outcome")
    assert outcomes[0].startswith("converged"), outcomes
    node.wait(15)
    assert commands[-1][1:] == (0, 0), "zero is commanded last"
    end(robot.bridge)
    report = robot.report()
    assert report["goal_error_px"] < 4 and abs(report["velocity"][0]) == 0, report
    print(f"servo: {outcomes[0]}; {report['goal_error_px']:.2f} px from the goal")
    return commands


def test_killed_servo(commands):
    robot, node = Robot("third", "{x: -3, y: 0.1, theta: 0}"), start_servo("third")
    call("/servo_third/enable", SetBool, True)
    wait_until(lambda: robot.speed() > 0.1, 30, "the robot moves")
    killed = time.time()
    end(node, signal.SIGKILL)
    wait_until(lambda: robot.speed() == 0, 5, "the robot stands")
    moving = [float(row["timestamp"]) for row in robot.rows() if float(row["v"]) != 0]
    assert moving[-1] - killed < 0.2 + 0.5 / 4 + 0.3, moving[-1] - killed  # ttl, braking, a loaded machine
    print(f"servo killed: the robot stands {moving[-1] - killed:.2f} s later")
    end(robot.bridge)
    robot.report()


def test_killed_camera(commands):
    robot, node = Robot("fourth", "{x: -3, y: 0.1, theta: 0}"), start_servo("fourth")
    call("/servo_fourth/enable", SetBool, True)
    wait_until(lambda: robot.speed() > 0.1, 30, "the robot moves")
    killed = time.time()
    end(robot.bridge, signal.SIGKILL)
    wait_until(lambda: commands[-1][1:] == (0, 0), 5, "the servo commands zero")
    moving = [t for t, v, w in commands if v or w]
    assert moving[-1] - killed < 0.5 + 0.5 / 4 + 0.3, moving[-1] - killed  # image_age, braking, a loaded machine
    wait_until(lambda: robot.speed() == 0, 5, "the robot stands")
    print(f"camera killed: zero is commanded {moving[-1] - killed:.2f} s later")
    node.wait(20)
    robot.report()


start("/usr/bin/rosmaster", "--core", "-p", PORT, name="rosmaster")
limit = time.time() + 20
while True:
    try:
        socket.create_connection(("127.0.0.1", PORT), 1).close()
        break
    except OSError:
        assert time.time() < limit, "no rosmaster"
        time.sleep(0.1)
rospy.init_node("ros_test", disable_signals=True)
which = sys.argv[5:] or ["playback", "servo"]
if "playback" in which:
    test_playback()
if "servo" in which:
    heard = test_servo()
    test_killed_servo(heard)
    test_killed_camera(heard)
print("ok")
end_all()
os._exit(0)
