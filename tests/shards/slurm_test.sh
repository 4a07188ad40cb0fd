#!/bin/sh
# The shards of a small map as a Slurm array, with a controller, a node and an authentication of their own on this machine.
# usage: slurm_test.sh PROGRAMS PLUGINS; ends with 77 where Slurm cannot run.
set -eu
programs=$1
plugins=$2
skip() { echo "SKIPPED: $1"; exit 77; }
for tool in munged slurmctld slurmd sbatch squeue; do
  command -v $tool > /dev/null || skip "$tool is not installed (packages slurm-wlm and munge)"
done
[ "$(id -u)" = 0 ] || skip "slurmd needs root"

work=$(mktemp -d /tmp/vantage-slurm-XXXXXX)
finish() {
  for service in slurmd slurmctld munged; do
    [ -s "$work/$service.pid" ] && kill "$(cat "$work/$service.pid")" 2> /dev/null
  done
  sleep 1
  rm -rf "$work"
}
trap finish EXIT
chmod 755 "$work"
mkdir "$work/state" "$work/spool" "$work/munge"
chmod 711 "$work/munge"
head -c 128 /dev/urandom > "$work/munge/key"
chmod 600 "$work/munge/key"
munged --force --socket="$work/munge/socket" --key-file="$work/munge/key" --pid-file="$work/munged.pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed" || skip "munged does not start"
host=$(hostname -s)
cat > "$work/slurm.conf" << CONF
ClusterName=vantage
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$((20000 + $$ % 20000))
SlurmdPort=$((40000 + $$ % 20000))
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
TaskPlugin=task/none
ReturnToService=2
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(($(awk "/MemTotal/ { print \$2 }" /proc/meminfo) / 1024 - 64)) State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
case "$(slurmd -V)" in
  "slurm-wlm 22."*) ;;  # does not know the word
  *) echo "CgroupPlugin=disabled" > "$work/cgroup.conf" ;;
esac
export SLURM_CONF=$work/slurm.conf
timeout 20 slurmctld || skip "slurmctld does not start"
timeout 20 slurmd || skip "slurmd does not start"
for _ in $(seq 15); do
  timeout 5 sinfo -h -o %t 2> /dev/null | grep -q idle && break
  sleep 1
done
timeout 5 sinfo -h -o %t | grep -q idle || skip "the node does not become idle"

# A level square with a wall, 60 m wide, as ascii PCD.
awk 'BEGIN {
  for (x = 0; x < 60; x += 0.5) for (y = 0; y < 40; y += 0.5) p[n++] = x " " y " " 0
  for (x = 0; x < 60; x += 0.5) for (z = 0.5; z < 5; z += 0.5) p[n++] = x " " 20 " " z
  print "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " n "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0"
  print "POINTS " n "\nDATA ascii"
  for (i = 0; i < n; ++i) print p[i]
}' > "$work/map.pcd"
cat > "$work/map.toml" << CONFIG
schema = 1
[map]
files = ["tiles"]
[partitioner]
plugin = "uniform_grid"
params = { cell_width = 10.0 }
[ground]
plugin = "pmf"
params = { max_window = 5.0 }
[viewpoints]
voxel_size = 5.0
[visibility]
plugin = "keep_all"
max_range = 10.0
[store]
plugin = "pcd_tiles"
params = { root = "bundle" }
CONFIG
cd "$work"
"$programs/vantage-tile" map.pcd -o tiles -q > /dev/null
"$programs/vantage-build" map.toml -q --plugin-dir "$plugins" --set store.params.root=whole > /dev/null
"$programs/vantage-submit" map.toml -q --plugin-dir "$plugins" --engine slurm --shards 3 --memory 3MiB
for _ in $(seq 120); do
  [ -d bundle ] && break
  [ -z "$(squeue -h)" ] && sleep 1 && break
  sleep 0.5
done
if [ ! -d bundle ]; then
  echo "FAILED: Slurm made no bundle"
  squeue || true
  tail -n 20 "$work"/bundle.parts.submit/*.log "$work"/slurmctld.log || true
  exit 1
fi
diff -r whole bundle
for _ in $(seq 40); do  # the job of the merge removes what is left
  [ -d bundle.parts.submit ] || break
  sleep 0.5
done
[ ! -e bundle.parts ] && [ ! -e bundle.parts.submit ] || { echo "FAILED: something is left"; ls -a bundle.parts*; exit 1; }
echo "Slurm made the bundle of a build in memory"
