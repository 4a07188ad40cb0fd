#!/bin/sh
# Records runs and has MCAP's own JavaScript reader compare them with the runs' other files.
#   read_recordings.sh PROGRAMS SAMPLES CONFIGS NODE_FOLDER
# PROGRAMS: folder of the built programs; SAMPLES: mcap_samples; CONFIGS: configs/ of the project;
# NODE_FOLDER: where npm may put the reader, unless $VANTAGE_NODE_MODULES has it.
# Exit code 4: skipped, there is no node or no reader.
set -eu
programs=$1 samples=$2 configs=$3 node_folder=$4
here=$(cd "$(dirname "$0")" && pwd)

. "$here/../support/node_modules.sh"
use_packages "MCAP's JavaScript reader" "$node_folder" @mcap/core@2.2.2 @mcap/support@1.1.0 \
  @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

mkdir samples
"$samples" messages samples
node "$here/check_samples.mjs" samples

"$programs/vantage-simulate" "$configs/simulate/demo.toml" --out world --quiet >/dev/null
# Scans 0 to 2 show nothing beyond the least range, so that the sensor is nowhere yet; 40 to 42
# neither, so that it is lost on its way.
kept=60
mkdir scans blinded
find world/scans -name '*.pcd' | sort | head -n $kept | while read -r scan; do
  cp "$scan" scans
  cp "$scan" blinded
done
head -n $kept world/scans/times.txt | tee scans/times.txt >blinded/times.txt
for number in 0 1 2 40 41 42; do
  printf 'VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n0.1 0 0\n' \
    >"$(find blinded -name '*.pcd' | sort | sed -n "$((number + 1))p")"
done
cat >config.toml <<'END'
schema = 1
[map]
files = ["world/map.pcd"]
[partitioner]
plugin = "uniform_grid"
params = { cell_width = 20.0 }
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = 2.0
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
END

# localize OUT SCANS MORE...
localize() {
  out=$1 scans=$2
  shift 2
  "$programs/vantage-localize" config.toml --scans "$scans" --reference world/reference.tum \
    --out "$out" --quiet "$@"
}
expect() {
  grep -q "$1" "$2" || {
    echo "expected '$1' in:"
    cat "$2"
    exit 1
  }
}

"$programs/vantage-build" config.toml --quiet >/dev/null
localize plain scans >/dev/null
localize recorded scans --mcap recorded/run.mcap >recorded.txt
cmp plain/trajectory.tum recorded/trajectory.tum
expect "recorded in recorded/run.mcap" recorded.txt
node "$here/check_run.mjs" recorded/run.mcap recorded scans yes 0,0,0 0

localize blind blinded --initial-pose auto >/dev/null
localize recorded_blind blinded --initial-pose auto --mcap blind.mcap >/dev/null
cmp blind/trajectory.tum recorded_blind/trajectory.tum
node "$here/check_run.mjs" blind.mcap recorded_blind blinded yes 0,0,0 02

"$programs/vantage-build" config.toml --quiet --set store.content=prepared \
  --set store.params.root=prepared >/dev/null
localize without_points scans --mcap without_points.mcap --set store.content=prepared \
  --set store.params.root=prepared >without_points.txt
expect "no region maps (the bundle holds prepared maps only, no points)" without_points.txt
node "$here/check_run.mjs" without_points.mcap without_points scans no 0,0,0 0

"$samples" shift world 500000 4100000 0
"$programs/vantage-build" config.toml --set store.params.root=far --quiet >/dev/null
localize far scans --mcap far.mcap --set store.params.root=far >far.txt
expect "m subtracted from all places" far.txt
node "$here/check_run.mjs" far.mcap far scans yes "$(sed -n \
  's/.*; \([-0-9.e+]*\) \([-0-9.e+]*\) \([-0-9.e+]*\) m subtracted.*/\1,\2,\3/p' far.txt)" 0
