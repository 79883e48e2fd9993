#!/usr/bin/env bash
# A Slurm cluster of this one machine, started and stopped here, runs a study as a job array; one task is killed and requeued.
#
#   slurm_cluster.sh TESSERA SBATCH_SCRIPT STUDY OUT SHARDS
#
# Exit status: 0 all tasks done and the results joined in OUT · 77 cannot run here, standard output says why · else a failure.
set -euo pipefail
tessera=$1 script=$2 study=$3 out=$4 shards=$5

skip() { echo "$1"; exit 77; }
[ "$(id -u)" -eq 0 ] || skip "a Slurm cluster of its own needs root"
for program in slurmctld slurmd sbatch squeue scontrol scancel munged; do
  command -v "$program" >/dev/null || PATH=$PATH:/usr/sbin command -v "$program" >/dev/null || skip "$program is not installed (slurmctld slurmd slurm-client munge)"
done
PATH=$PATH:/usr/sbin
id munge >/dev/null 2>&1 || skip "there is no user munge"

work=$(mktemp -d -t tessera-slurm-XXXXXX)
chmod 755 "$work"
daemons=()
stop() {
  local status=$?
  # Running jobs end before the daemons that watch over them.
  if [ -n "${SLURM_CONF:-}" ]; then
    timeout 5 scancel --user=root >/dev/null 2>&1 || true
    for _ in $(seq 100); do [ -n "$(timeout 5 squeue --noheader 2>/dev/null)" ] || break; sleep 0.1; done
  fi
  for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${daemons[@]}"; do wait "$pid" 2>/dev/null || true; done
  if [ $status -ne 0 ] && [ $status -ne 77 ]; then tail -n 40 "$work"/*.log >&2 || true; fi
  rm -rf "$work"
  exit $status
}
trap stop EXIT
trap "exit 1" INT TERM

# Waits until a command succeeds: wait_for SECONDS WHAT COMMAND...
wait_for() {
  local seconds=$1 what=$2
  shift 2
  for _ in $(seq $((seconds * 10))); do
    if "$@" >/dev/null 2>&1; then return 0; fi
    sleep 0.1
  done
  echo "gave up after $seconds s waiting for $what" >&2
  return 1
}

# ---- munge, as its own user ----
install -d -o munge -g munge -m 755 "$work/munge"
head -c 1024 /dev/urandom >"$work/munge/key"
chown munge: "$work/munge/key"
chmod 600 "$work/munge/key"
setpriv --reuid=munge --regid=munge --clear-groups munged --foreground --key-file="$work/munge/key" --socket="$work/munge/socket" \
  --pid-file="$work/munge/pid" --log-file="$work/munge/log" --seed-file="$work/munge/seed" 2>"$work/munged.log" &
daemons+=($!)
wait_for 20 "munge" test -S "$work/munge/socket"

# ---- a controller and one node ----
host=$(hostname -s)
port=$((20000 + $$ % 20000))
mkdir -p "$work/state" "$work/spool"
cat >"$work/slurm.conf" <<CONF
ClusterName=tessera
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=5
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/builtin
JobRequeue=1
ReturnToService=2
MinJobAge=600
KillWait=5
SlurmctldPort=$port
SlurmdPort=$((port + 1))
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES State=UP
CONF
export SLURM_CONF=$work/slurm.conf
slurmctld -D >"$work/controller.log" 2>&1 &
daemons+=($!)
slurmd -D -N "$host" >"$work/node.log" 2>&1 &
daemons+=($!)
node_is_idle() { sinfo --noheader --format=%T | grep -qx idle; }
wait_for 60 "the node" node_is_idle

# ---- the array ----
cd "$work"
job=$(TESSERA=$tessera sbatch --parsable --array="0-$((shards - 1))" --output="$work/task-%a.log" "$script" "$study" "$out")
state_of() { scontrol --oneliner show job "${job}_$1" | grep -o 'JobState=[A-Z_]*' | cut -d= -f2; }
is() { [ "$(state_of "$1")" = "$2" ]; }
# Task 0 is killed once it has a result, in the middle of its work, and put back into the queue.
has_result() { compgen -G "$out/points/*.json"; }
wait_for 120 "a first result" has_result
wait_for 60 "task 0" is 0 RUNNING
task_job=$(scontrol --oneliner show job "${job}_0" | grep -o '^JobId=[0-9]*' | cut -d= -f2)
for pid in $(scontrol listpids "$task_job" | awk 'NR > 1 && $1 > 0 { print $1 }'); do
  if [ "$(readlink "/proc/$pid/exe")" = "$(readlink -f "$tessera")" ]; then kill -KILL "$pid"; fi
done
wait_for 60 "the end of task 0" is 0 FAILED
scontrol requeue "${job}_0"
all_done() {
  local task
  for task in $(seq 0 $((shards - 1))); do is "$task" COMPLETED || return 1; done
}
wait_for 300 "all tasks" all_done
scontrol --oneliner show job "${job}_0" | grep -o 'Restarts=[0-9]*'
"$tessera" report "$out"
