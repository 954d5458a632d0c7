#!/usr/bin/env bash
# A whole Slurm on this machine's loopback, without systemd, for tests: munged, slurmctld and one slurmd a node.
# slurm_loopback.sh start DIR [NODES]   writes keys, slurm.conf and logs into the new or empty folder DIR, starts the
#                                       daemons on free ports of 127.0.0.1 and waits until the nodes render1, … are idle;
#                                       afterwards SLURM_CONF=DIR/slurm.conf lets sbatch and the others find them
# slurm_loopback.sh crash DIR NODE      what a power cut does: SIGKILL to the node's slurmd, its jobs and their processes;
#                                       then the node boots, and Slurm learns that its jobs are gone
# slurm_loopback.sh jobs DIR [NODE]     the process ids of what jobs run now, one a line
# slurm_loopback.sh logs DIR            the daemons' logs
# slurm_loopback.sh stop DIR            ends jobs and daemons and removes DIR
# Debian 12's packages slurmctld, slurmd, slurm-client and munge. Any user that has a name will do: daemons and jobs run
# as that user. Every node claims 4 CPUs, whatever the machine has, so that small jobs run side by side.
# Exit codes: 0 done, 1 Slurm does not come up (its logs go to stderr), 2 usage, 3 this machine cannot run it.
set -euo pipefail

readonly cpus=4            # a node's
readonly start_seconds=30  # until all nodes are idle
readonly boot_seconds=7    # a crashed node is away for longer than BatchStartTimeout + MessageTimeout: see slurm.conf

die() {
  printf 'slurm_loopback: %s\n' "$2" >&2
  exit "$1"
}

# Debian has the daemons in /usr/sbin, which is not in everybody's PATH.
PATH="$PATH:/usr/sbin:/sbin"

require_machine() {
  local program missing=()
  for program in munged mungekey slurmctld slurmd sinfo scancel python3; do
    command -v "$program" >/dev/null || missing+=("$program")
  done
  [[ ${#missing[@]} -eq 0 ]] || die 3 "${missing[*]} not found: install slurmctld slurmd slurm-client munge python3"
  id -un >/dev/null 2>&1 || die 3 "user $(id -u) has no name, and Slurm knows users by name: run it as root"
}

# N ports that nobody listens on now.
free_ports() {
  python3 -c '
import socket, sys
sockets = [socket.socket() for _ in range(int(sys.argv[1]))]
for s in sockets: s.bind(("127.0.0.1", 0))
print(*(s.getsockname()[1] for s in sockets))' "$1"
}

write_configuration() {
  local dir=$1 nodes=$2 ports node memory
  read -ra ports <<<"$(free_ports $((nodes + 1)))"
  memory=$(awk '/^MemTotal/ {print int($2 / 1024)}' /proc/meminfo)
  cat >"$dir/slurm.conf" <<EOF_CONF
ClusterName=loopback
SlurmctldHost=$(uname -n | cut -d. -f1)(127.0.0.1)
SlurmctldPort=${ports[0]}
# Nothing listens beyond loopback.
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
# A job that goes back into the queue waits for as long as its credential would live: the default is two minutes.
AuthInfo=socket=$dir/munge.socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool/%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.%n.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.%n.log
SlurmctldDebug=verbose
SlurmdDebug=verbose
# No cgroups: containers seldom lend them.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
MpiDefault=none
SwitchType=switch/none
# The node that does least comes first: jobs spread out.
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU,CR_LLN
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,sched_min_interval=0,batch_sched_delay=0
# More CPUs than there are: as configured.
SlurmdParameters=config_overrides
# Jobs must say themselves that they may be started again.
JobRequeue=0
# A node that comes back without a job that it should have has lost it, unless the job began less than the sum ago.
BatchStartTimeout=1
MessageTimeout=5
ReturnToService=2
# Long: nodes answer slowly where the machine is busy, and nothing here waits for one to be given up.
SlurmdTimeout=300
SlurmctldTimeout=300
KillWait=2
EOF_CONF
  for ((node = 1; node <= nodes; ++node)); do
    printf 'NodeName=render%d NodeHostname=localhost NodeAddr=127.0.0.1 Port=%d CPUs=%d RealMemory=%d State=UNKNOWN\n' \
      "$node" "${ports[node]}" "$cpus" "$memory"
  done >>"$dir/slurm.conf"
  printf 'PartitionName=render Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n' >>"$dir/slurm.conf"
}

# Its key, socket and logs in DIR. --force: the folders above need not be as strict as those of a system's munged.
start_munged() {
  local dir=$1
  mungekey --create --keyfile "$dir/munge.key"
  munged --force --num-threads=2 --socket "$dir/munge.socket" --key-file "$dir/munge.key" \
    --seed-file "$dir/munge.seed" --pid-file "$dir/munged.pid" --log-file "$dir/munged.log" 2>>"$dir/start.log"
}

nodes_of() { sed -n 's/^NodeName=\(render[0-9]*\) .*/\1/p' "$1/slurm.conf"; }

all_idle() {
  local states
  states=$(timeout 5 sinfo --noheader --Node --format=%T 2>/dev/null) || return 1
  [[ "$(grep -cx idle <<<"$states")" -eq "$(nodes_of "$1" | wc -l)" ]]
}

print_logs() {
  local log
  for log in "$1"/*.log; do
    [[ -e "$log" ]] || continue
    printf '== %s\n' "$log"
    tail -n 60 -- "$log"
  done
}

# Whatever fails in start: logs, then everything down again.
give_up() {
  trap - EXIT
  print_logs "$starting" >&2
  stop "$starting"
  exit 1
}

start() {
  local dir=$1 nodes=${2:-1} node deadline
  [[ "$nodes" =~ ^[1-9][0-9]?$ ]] || die 2 "NODES is 1 to 99, not \"$nodes\""
  require_machine
  mkdir -p -- "$dir"
  dir=$(realpath -- "$dir")
  [[ -z "$(ls -A -- "$dir")" ]] || die 2 "$dir is not empty"
  [[ "$dir" != *[[:space:]#,%]* ]] || die 2 "$dir: slurm.conf has no way to write blanks, commas, # or % in a path"
  # sockaddr_un holds 107 bytes; slurmstepd's sockets, DIR/spool/render1/render1_123.4294967291, are the longest.
  [[ ${#dir} -le 60 ]] || die 2 "$dir: at most 60 characters, as the paths of sockets are short"
  # munged lets other users of the machine in only where they can reach its socket.
  chmod 755 "$dir"
  mkdir "$dir/state" "$dir/spool"
  write_configuration "$dir" "$nodes"
  export SLURM_CONF="$dir/slurm.conf"
  starting=$dir
  trap give_up EXIT
  start_munged "$dir"
  # The daemons go on with DIR as their folder; what they print before they have a log goes into one as well.
  (cd "$dir" && slurmctld >>"$dir/start.log" 2>&1 </dev/null)
  for node in $(nodes_of "$dir"); do start_slurmd "$dir" "$node"; done
  deadline=$((SECONDS + start_seconds))
  until all_idle "$dir"; do
    if ((SECONDS >= deadline)); then
      printf 'slurm_loopback: the nodes are not idle after %d s\n' "$start_seconds" >&2
      sinfo --Node --long >&2 || true
      exit 1
    fi
    sleep 0.2
  done
  trap - EXIT
}

start_slurmd() { (cd "$1" && SLURM_CONF="$1/slurm.conf" slurmd -N "$2" >>"$1/start.log" 2>&1 </dev/null); }

# Processes with "NAME=VALUE" in the environment that they were started with.
processes_with() { grep -lzsx -e "$1" /proc/[0-9]*/environ | cut -d/ -f3 || true; }

# Everything that jobs run: what slurmd sets for them, and only where this Slurm is theirs. With NODE: of that node.
job_processes() {
  local dir=$1 node=${2:-} pid
  for pid in $(processes_with "SLURM_CONF=$dir/slurm.conf"); do
    if grep -qzs -e "^SLURMD_NODENAME=${node:-.}" "/proc/$pid/environ" 2>/dev/null; then printf '%s\n' "$pid"; fi
  done
}

# slurmstepd, the parent of every job's script, keeps no environment to be known by: those whose folder is DIR.
step_daemons() {
  local dir=$1 link
  for link in /proc/[0-9]*/cwd; do
    [[ "$(readlink -- "$link" 2>/dev/null)" == "$dir" ]] || continue
    if [[ "$(cat "${link%cwd}comm" 2>/dev/null)" == slurmstepd ]]; then cut -d/ -f3 <<<"$link"; fi
  done
}

parent_of() { sed -n 's/^PPid:\t//p' "/proc/$1/status" 2>/dev/null || true; }

kill_hard() { if [[ $# -gt 0 ]]; then kill -KILL "$@" 2>/dev/null || true; fi; }

crash() {
  local dir=$1 node=$2 jobs pid victims=()
  dir=$(realpath -- "$dir")
  [[ -r "$dir/slurmd.$node.pid" ]] || die 2 "$dir has no running node \"$node\""
  victims=("$(cat "$dir/slurmd.$node.pid")")
  mapfile -t jobs < <(job_processes "$dir" "$node")
  for pid in "${jobs[@]}"; do
    if [[ "$(cat "/proc/$(parent_of "$pid")/comm" 2>/dev/null)" == slurmstepd ]]; then
      victims+=("$(parent_of "$pid")")
    fi
  done
  # All at once, the parents first: none of them may see another one end.
  kill_hard "${victims[@]}" "${jobs[@]}"
  rm -f -- "$dir/slurmd.$node.pid"
  sleep "$boot_seconds"
  start_slurmd "$dir" "$node"
}

# One of these processes lives.
any_alive() {
  local pid
  for pid in "$@"; do
    if kill -0 "$pid" 2>/dev/null; then return 0; fi
  done
  return 1
}

stop() {
  local dir pids tries
  [[ -r "$1/slurm.conf" ]] || return 0
  dir=$(realpath -- "$1")
  # The daemons are asked and have 5 s; then what they leave behind goes, jobs and their slurmstepd too.
  mapfile -t pids < <(cat -- "$dir"/*.pid 2>/dev/null)
  if [[ ${#pids[@]} -gt 0 ]]; then kill -TERM "${pids[@]}" 2>/dev/null || true; fi
  for ((tries = 0; tries < 50; ++tries)); do
    any_alive "${pids[@]}" || break
    sleep 0.1
  done
  mapfile -t -O "${#pids[@]}" pids < <(step_daemons "$dir" && job_processes "$dir")
  kill_hard "${pids[@]}"
  rm -rf -- "$dir"
}

usage() { die 2 "usage: slurm_loopback.sh start DIR [NODES] | crash DIR NODE | jobs DIR [NODE] | logs DIR | stop DIR"; }

case "${1:-}/$#" in
  start/2 | start/3) start "${@:2}" ;;
  crash/3) crash "$2" "$3" ;;
  jobs/2 | jobs/3) job_processes "$(realpath -- "$2")" "${3:-}" ;;
  logs/2) print_logs "$2" ;;
  stop/2) stop "$2" ;;
  *) usage ;;
esac
