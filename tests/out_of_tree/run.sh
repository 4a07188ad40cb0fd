#!/usr/bin/env bash
# What an author of a plugin does, from an installed Vantage that has been moved: a new project for every
# kind, built in a folder of its own, held to its contract, found through VANTAGE_PLUGIN_PATH and run.
#
# usage: run.sh BUILD_DIR DATA_DIR [cmake option...]
set -euo pipefail
build=$1 data=$2
shift 2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

say() { printf '== %s\n' "$*"; }
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }

say "installing, and moving what was installed"
cmake --install "$build" --prefix "$work/first" >/dev/null
mv "$work/first" "$work/prefix"
vantage=$work/prefix/bin/vantage
"$vantage" plugins list | grep >/dev/null "$work/prefix/lib.*/vantage/vantage_partitioner_uniform_grid.so" ||
  fail "the moved installation does not find its own plugins"
grep -rIl -e "$build" -e "$work/first" "$work/prefix" && fail "the files above name a build folder"

for kind in partitioner ground visibility store matcher selector relocalizer; do
  [ -d "$here/../../apps/plugins/templates/$kind" ] || fail "no template for a $kind plugin"
  say "a new $kind plugin: my_$kind"
  project=$work/projects/my_$kind
  "$vantage" plugins new "$kind" "my_$kind" --out "$project" 2>/dev/null
  cmake -S "$project" -B "$project/build" -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Wpedantic -Werror" "$@" >/dev/null
  cmake --build "$project/build" >"$work/log" 2>&1 || { cat "$work/log"; fail "my_$kind does not build"; }
  ctest --test-dir "$project/build" --output-on-failure >"$work/log" 2>&1 || { cat "$work/log"; fail "my_$kind does not keep its contract"; }
  grep "tests passed" "$work/log"
  "$vantage" plugins check "$project/build/vantage_${kind}_my_$kind.so"
  VANTAGE_PLUGIN_PATH=$project/build "$vantage" plugins describe "my_$kind" --toml >/dev/null
done

say "every header of vantage::io and vantage::evaluation compiles by itself, with nothing but installed headers"
for header in "$work"/prefix/include/vantage/{io,evaluation}/*.hpp; do
  # shellcheck disable=SC2046
  g++ -std=c++20 -fsyntax-only -x c++ -I"$work/prefix/include" \
    $(pkg-config --cflags eigen3 2>/dev/null || echo -I/usr/include/eigen3) "$header" 2>"$work/log" ||
    { cat "$work/log"; fail "$(basename "$header") needs more than what is installed"; }
done

say "the examples build; the one of live use reads files and a bag, finds a simulated sensor and tracks it"
for name in live offline; do
  example=$work/prefix/share/vantage/examples/${name}_localization
  [ "$(wc -l <"$example/${name}_localization.cpp")" -lt 40 ] || fail "the example has 40 lines or more"
  cmake -S "$example" -B "$work/$name" -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Wpedantic -Werror" "$@" >/dev/null
  cmake --build "$work/$name" >"$work/log" 2>&1 || { cat "$work/log"; fail "the example does not build"; }
done
"$vantage" simulate "$here/../../configs/simulate/demo.toml" --out "$work/campus" --quiet
"$vantage" build "$here/../../configs/demo/L20.toml" --print-config \
  --set visibility.plugin=keep_all --set 'visibility.params={}' \
  --set "map.files=[\"$work/campus/map.pcd\"]" --set store.params.root="$work/campus_maps" >"$work/live.toml"
"$vantage" build "$work/live.toml" --quiet >/dev/null
mkdir "$work/scans"
find "$work/campus/scans" -name '*.pcd' | sort | sed -n '1,8p' | xargs cp -t "$work/scans"
head -n 8 "$work/campus/scans/times.txt" >"$work/scans/times.txt"
"$vantage" localize "$work/live.toml" --scans "$work/scans" --initial-pose auto --out "$work/run" \
  --mcap "$work/run.mcap" --quiet >/dev/null
# follows_8_scans RECORDING [TOPIC]
follows_8_scans() {
  "$work/live/live_localization" "$work/live.toml" "$@" >"$work/log" || { cat "$work/log"; fail "the example fails"; }
  cat "$work/log"
  [ "$(wc -l <"$work/log")" -eq 8 ] || fail "the example does not read 8 scans"
  [ "$(grep -Evc "lost|uncertain" "$work/log")" -ge 6 ] || fail "fewer than 6 of 8 scans are tracked"
}
follows_8_scans "$work/scans"
mv "$work/log" "$work/log_of_files"
follows_8_scans "$work/run.mcap" /scan
cmp "$work/log" "$work/log_of_files" || fail "the bag gives other poses than the files in it"

say "the other example localizes the bag and scores it"
"$work/offline/offline_localization" "$work/live.toml" "$work/run.mcap" /scan "$work/campus/reference.tum" >"$work/log" ||
  { cat "$work/log"; fail "the example fails"; }
tail -n 1 "$work/log"
[ "$(grep -c ' tracked ' "$work/log")" -ge 6 ] || { cat "$work/log"; fail "fewer than 6 of 8 scans are tracked"; }
grep -Eq '^[678] of 8 scans tracked, error 0\.[012][0-9]* m' "$work/log" || fail "the error is not below 0.3 m"

say "the new relocalizer makes the index of a bundle, and finds and tracks the drive with it"
export VANTAGE_PLUGIN_PATH=$work/projects/my_relocalizer/build
cp "$work/live.toml" "$work/found.toml"
cat >>"$work/found.toml" <<'TOML'

[relocalizer]
plugin = "my_relocalizer"
TOML
"$vantage" build "$work/found.toml" --set store.params.root="$work/found_maps" --quiet >/dev/null
"$vantage" info "$work/found_maps" | grep -q 'index of places *my_relocalizer' || fail "info does not name the relocalizer"
"$vantage" localize "$work/found.toml" --set store.params.root="$work/found_maps" --scans "$work/campus/scans" \
  --reference "$work/campus/reference.tum" --initial-pose auto --out "$work/found" --quiet >"$work/log" ||
  { cat "$work/log"; fail "the drive is not localized"; }
grep ' scans' "$work/log"
[ "$(cut -d, -f2 "$work/found/scans.csv" | grep -c '^tracked$')" -ge 150 ] || fail "fewer than 150 of 158 scans are tracked"
cmp -s "$work/found_maps/places.dat" "$work/campus_maps/places.dat" && fail "the index is that of voxel_search"
unset VANTAGE_PLUGIN_PATH

say "the mistake of docs/plugin_author.md is found by the clause that it names"
project=$work/projects/my_partitioner
cp -r "$project" "$work/mistaken"
rm -rf "$work/mistaken/build"
sed -i 's/above(bounds.max.y())/bounds.max.y()/' "$work/mistaken/my_partitioner.cpp"
cmp -s "$project/my_partitioner.cpp" "$work/mistaken/my_partitioner.cpp" && fail "the template has no such line"
cmake -S "$work/mistaken" -B "$work/mistaken/build" -DCMAKE_PREFIX_PATH="$work/prefix" "$@" >/dev/null
cmake --build "$work/mistaken/build" --target vantage_partitioner_my_partitioner >/dev/null
"$vantage" conformance "$work/mistaken/build/vantage_partitioner_my_partitioner.so" "$project/params.toml" \
  >"$work/log" 2>&1 && fail "the suite did not see the mistake"
grep -q "^FAILED   P2 " "$work/log" || { cat "$work/log"; fail "P2 does not fail"; }

say "a plugin may have the name of something in its template"
for pair in "partitioner params" "ground point" "visibility scene" "store bundle" "matcher target" "relocalizer index"; do
  read -r kind name <<<"$pair"
  "$vantage" plugins new "$kind" "$name" --out "$work/names/$kind" 2>/dev/null
  # shellcheck disable=SC2046
  g++ -std=c++20 -fsyntax-only -I"$work/prefix/include" $(pkg-config --cflags eigen3 2>/dev/null || echo -I/usr/include/eigen3) \
    "$work/names/$kind/$name.cpp" || fail "a $kind plugin called $name does not compile"
done

say "a mistake in using the SDK is told"
mkdir -p "$work/wrong"
cat >"$work/wrong/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.25)
project(wrong LANGUAGES CXX)
find_package(vantage REQUIRED)
vantage_add_plugin(partitoner wrong SOURCES wrong.cpp)
CMAKE
if cmake -S "$work/wrong" -B "$work/wrong/build" -DCMAKE_PREFIX_PATH="$work/prefix" "$@" >"$work/log" 2>&1; then
  fail "a kind that does not exist was accepted"
fi
grep -q "no kind 'partitoner'" "$work/log" || { cat "$work/log"; fail "the message does not name the kind"; }
sed -i -e 's/partitoner/partitioner/' -e '$a if(TARGET vantage::io OR TARGET vantage::io_zstd)\n  message(FATAL_ERROR "io without asking")\nendif()' \
  "$work/wrong/CMakeLists.txt"
touch "$work/wrong/wrong.cpp"
cmake -S "$work/wrong" -B "$work/wrong/build" -DCMAKE_PREFIX_PATH="$work/prefix" "$@" >"$work/log" 2>&1 ||
  { cat "$work/log"; fail "a plugin gets vantage::io, which it did not ask for"; }

if [ ! -d "$data/kitti_street" ]; then
  say "SKIPPED: no recorded data at $data (set VANTAGE_DATA_DIR): the plugin was not run on kitti_street"
  exit 0
fi
say "the new partitioner builds region maps of kitti_street"
export VANTAGE_PLUGIN_PATH=$work/projects/my_partitioner/build
"$vantage" build "$here/../../configs/kitti_street/L20.toml" --quiet \
  --set partitioner.plugin=my_partitioner --set 'partitioner.params={width=40.0}' \
  --set "map.files=[\"$data/kitti_street/map.pcd\"]" \
  --set viewpoints.voxel_size=20.0 --set store.params.root="$work/bundle"
[ -f "$work/bundle/strip0.pcd" ] || fail "the bundle holds no strip0.pcd"
