#!/bin/sh
# makeAll.sh [OUT]: writes the bags of this folder anew, each by others' code where there is any:
# Debian's python3-rosbag, python3-sensor-msgs, python3-nav-msgs, python3-tf2-msgs, npm, zstd, lz4.
set -e
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$here"
export PYTHONDONTWRITEBYTECODE=1
for packing in lz4 bz2; do /usr/bin/python3 makeRosBag.py drive "$out/$packing.bag" $packing; done
/usr/bin/python3 makeRosBag.py drive "$out/png.bag" none png
/usr/bin/python3 makeDb3.py drive "$out/little.db3"
/usr/bin/python3 makeDb3.py drive "$out/big.db3" big
/usr/bin/python3 messages.py drive > "$work/messages.json"
cp makeMcap.mjs "$work"
(cd "$work" && npm install --silent --no-audit --no-fund @mcap/core@2 @foxglove/rosmsg2-serialization@3 @foxglove/rosmsg-msgs-common@3 > /dev/null)
for packing in lz4 zstd; do node "$work/makeMcap.mjs" "$work/messages.json" "$out/$packing.mcap" $packing; done
