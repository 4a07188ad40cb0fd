#!/bin/sh
# Foxglove's own JavaScript client looks at a live localizer, by both names of the protocol.
#   read_foxglove.sh PROGRAMS CONFIGS NODE_FOLDER
# PROGRAMS: folder of the built programs; CONFIGS: configs/ of the project; NODE_FOLDER: where npm
# may put the client, unless $VANTAGE_NODE_MODULES has it.
# Exit code 4: skipped, there is no node or no client.
set -eu
programs=$1 configs=$2 node_folder=$3
here=$(cd "$(dirname "$0")" && pwd)

. "$here/../support/node_modules.sh"
use_packages "Foxglove's JavaScript client" "$node_folder" @foxglove/ws-protocol@0.8.0 \
  @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0 ws@8

work=$(mktemp -d)
live=
trap '[ -z "$live" ] || kill "$live" 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"

"$programs/vantage-simulate" "$configs/simulate/motion.toml" --out world --quiet \
  --set map.point_spacing=0.25 --set campus.size_x=60 --set campus.size_y=60 >/dev/null
port=$((20000 + $$ % 10000))
cat >config.toml <<END
schema = 1
[map]
files = ["world/map.pcd"]
[partitioner]
plugin = "uniform_grid"
params = { cell_width = 20.0 }
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = 5.0
sensor_height = 1.0
[visibility]
plugin = "keep_all"
max_range = 40.0
[store]
plugin = "pcd_tiles"
content = "points"
params = { root = "points" }
[matcher]
plugin = "ndt"
[localizer]
scan_min_range = 1.0
T_sensor_imu = [0.0, 0.0, -0.05, 0.0, 0.0, 0.0]
[live]
domain = $((100 + $$ % 100))
topics = { imu = "/imu", odometry = "/odom" }
[live.foxglove]
port = $port
END
"$programs/vantage-build" config.toml --quiet >/dev/null

"$programs/vantage-live" config.toml 2>live.txt &
live=$!
while ! grep -q "ready in domain" live.txt; do
  kill -0 "$live" || {
    cat live.txt
    exit 1
  }
  sleep 0.1
done
node "$here/read_foxglove.mjs" "ws://127.0.0.1:$port" foxglove.websocket.v1 >old.json 2>old.txt &
old=$!
node "$here/read_foxglove.mjs" "ws://127.0.0.1:$port" foxglove.sdk.v1 publish >new.json 2>new.txt &
new=$!
while [ "$(grep -c 'a Foxglove client is there' live.txt)" -lt 2 ]; do
  kill -0 "$old" && kill -0 "$new" || {
    cat old.txt new.txt
    exit 1
  }
  sleep 0.1
done
"$programs/vantage-play" config.toml --scans world/scans --imu world/imu.csv \
  --odometry world/odometry.tum >/dev/null
kill -TERM "$live"
wait "$live"
live=
failed=0
wait "$old" || failed=1
wait "$new" || failed=1
grep -q "a pose is given: looks for the sensor at" live.txt || failed=1
if [ $failed -ne 0 ]; then
  cat live.txt old.txt new.txt
  head -c 4000 new.json
  exit 1
fi
echo "both clients decoded all; the pose that one published was taken"
