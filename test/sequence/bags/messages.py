#!/usr/bin/python3
"""messages.py DRIVE > MESSAGES.json: for makeMcap.mjs."""
import base64, json, sys
from drive import Drive, RECEIVED_LATER

drive = Drive(sys.argv[1])
c = drive.camera
rows = [(ns, {"topic": "/odom", "v": v, "w": w}) for ns, v, w in drive.twists]
for ns, _, (width, height, levels) in drive.images:
    rows.append((ns, {"topic": "/camera/image_raw", "width": width, "height": height,
                      "levels": base64.b64encode(levels).decode()}))
    rows.append((ns, {"topic": "/camera/camera_info", **c}))
rows.sort(key=lambda row: row[0])
rows.insert(0, (rows[0][0], {"topic": "/tf_static", "frames": drive.frames}))
json.dump({"received_later": int(RECEIVED_LATER * 1e9), "messages": [{"ns": str(ns), **m} for ns, m in rows]}, sys.stdout)
