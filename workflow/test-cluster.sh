#!/bin/sh
# Starts a Slurm of two nodes on this one machine, runs a small folder of recordings in every way that docs/cluster.md tells of, kills a node in the
# middle, and compares with `freeswing batch` to the byte. A line a check; exit code 0 only if all hold. `make test-cluster` sets up what it needs.
#
#     FREESWING=target/release/freeswing workflow/test-cluster.sh [WORKING FOLDER]
set -eu

here=$(cd "$(dirname "$0")" && pwd)
work=${1-$here/../target/cluster}
mkdir -p "$work"
work=$(cd "$work" && pwd)
FREESWING=$(realpath "${FREESWING:-$(command -v freeswing)}")
export FREESWING
OPTIONS='--until fit --no-overlay'
SLURM_CONF=$work/slurm/slurm.conf
export SLURM_CONF
# Slurm's daemons are not on everyone's path
PATH=$PATH:/usr/sbin:/sbin
srun=$(command -v srun) || { echo 'test-cluster: no Slurm here; make test-cluster installs it' >&2; exit 2; }
PATH=$work/bin:$PATH
export PATH

failures=0
began=$(date +%s)
check() {
    text=$1
    shift
    if "$@" >>"$work/checks.txt" 2>&1; then echo "ok    $text"; else
        echo "FAIL  $text"
        failures=$((failures + 1))
    fi
}
note() { echo "      $1"; }
since() { echo "$(($(date +%s) - $1)) s"; }
# until_ SECONDS COMMAND…: whether it came true in this time
until_() {
    limit=$(($(date +%s) + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ "$(date +%s)" -lt "$limit" ] || return 1
        sleep 0.2
    done
}

# ---- a Slurm of two nodes

daemons=
stop_all() {
    trap - EXIT INT TERM
    if [ -n "$daemons" ]; then
        for job in $(squeue -h -o %A 2>/dev/null | sort -u); do scancel "$job" 2>/dev/null || :; done
        until_ 10 no_jobs_run || :
        for pid in $daemons; do kill "$pid" 2>/dev/null || :; done
        until_ 5 none_lives || for pid in $daemons; do kill -9 "$pid" 2>/dev/null || :; done
    fi
    [ -z "${snakemake_group-}" ] || kill -9 "-$snakemake_group" 2>/dev/null || :
}
no_jobs_run() { [ -z "$(squeue -h -t R,CG -o %i)" ]; }
no_jobs() { [ -z "$(squeue -h -t PD,R,CG,CF -o %i)" ]; }
none_lives() { for pid in $daemons; do ! kill -0 "$pid" 2>/dev/null || return 1; done; }
trap stop_all EXIT
trap 'exit 130' INT TERM

start_node() {
    slurmd -D -N "$1" >"$work/slurm/$1.txt" 2>&1 &
    daemons="$daemons $!"
    eval "node_$1=$!"
}
start_slurm() {
    rm -rf "$work/slurm"
    mkdir -p "$work/slurm/state"
    host=$(uname -n)
    cat >"$SLURM_CONF" <<END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=26817
AuthType=auth/none
CredType=cred/none
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
StateSaveLocation=$work/slurm/state
SlurmdSpoolDir=$work/slurm/%n
SlurmctldPidFile=$work/slurm/slurmctld.pid
SlurmdPidFile=$work/slurm/%n.pid
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=5,batch_sched_delay=1
ReturnToService=2
MinJobAge=86400
# a node that says nothing for so long is taken for lost
SlurmdTimeout=10
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=26821 CPUs=1 RealMemory=16000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=26822 CPUs=1 RealMemory=16000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
END
    # the plugin clears the environment of a job, and its srun would look for /etc/slurm
    mkdir -p "$work/bin"
    printf '#!/bin/sh\nSLURM_CONF="%s" exec "%s" "$@"\n' "$SLURM_CONF" "$srun" >"$work/bin/srun"
    chmod +x "$work/bin/srun"
    slurmctld -D >"$work/slurm/slurmctld.txt" 2>&1 &
    daemons=$!
    start_node n1
    start_node n2
}
idle_nodes() { [ "$(sinfo -h -N -t idle -o %N | sort -u | wc -l)" -eq "$1" ]; }

# Every process of a node's jobs, the youngest first, and their step managers: as a machine loses power, but in the order that is worst for those that watch others.
processes_on() {
    for own in /proc/[0-9]*; do
        if grep -qzx "SLURMD_NODENAME=$1" "$own/environ" 2>/dev/null; then
            echo "${own#/proc/}"
            parent=$(sed -n 's/^PPid:\t//p' "$own/status" 2>/dev/null || :)
            [ "$(cat "/proc/$parent/comm" 2>/dev/null)" != slurmstepd ] || echo "$parent"
        fi
    done | sort -rnu
}
kill_node() {
    victims=$(processes_on "$1")
    daemon=
    eval "daemon=\$node_$1"
    # shellcheck disable=SC2086 # a list of numbers
    kill -9 $daemon $victims
    note "killed node $1: slurmd and $(echo "$victims" | wc -w) processes of its job"
}

# ---- the ways, each in a folder of its own with the same names in it, as messages hold them

way() {
    rm -rf "${work:?}/$1"
    mkdir "$work/$1"
    ln -s ../recordings "$work/$1/recordings"
    cd "$work/$1"
}
# the recordings that are finished, and since when; one whose run was killed is not, and has no digest
finished() {
    find results -name run.json -not -path 'results/together/*' -exec grep -qE '"recording_sha256": "[0-9a-f]' {} \; -printf '%p %T@\n' 2>/dev/null | sort
}
how_many() { finished | wc -l; }
more_than() { [ "$(how_many)" -gt "$1" ]; }
# what was finished then has not been touched since
kept() { [ -z "$(finished | comm -13 - "$1")" ]; }
same() { for file in summary.csv summary.parquet index.html; do cmp "results/$file" "../a/results/$file" || return 1; done; }
agrees() {
    check "$1: summary.csv, summary.parquet and index.html are those of batch, to the byte" same
}
launch=
snakemake_() {
    # shellcheck disable=SC2086 # nothing, or two words
    $launch "$work/venv/bin/snakemake" --snakefile "$here/Snakefile" --config "freeswing=$FREESWING" "options=$OPTIONS" "$@"
}
part_on_n2() { part=$(squeue -h -r -w n2 -t R -o %K) && [ -n "$part" ]; }
in_the_middle() { grep -q '^\[1/.*done' "results/.slurm/part-$part.txt"; }

by_batch() {
    way a
    start=$(date +%s)
    code=0
    # shellcheck disable=SC2086 # options
    "$FREESWING" batch recordings --out results $OPTIONS >log.txt 2>&1 || code=$?
    all=$(how_many)
    check "batch: 12 done, 3 failed, exit code 1" test "$code$(grep -c '^.*,done,' results/summary.csv)$(grep -c '^.*,failed,' results/summary.csv)" = 1123
    note "batch alone: $all recordings in $(since "$start")"
}

by_slurm_array() {
    way b
    start=$(date +%s)
    # shellcheck disable=SC2086 # options
    "$here/slurm-array.sh" recordings results 4 $OPTIONS >log.txt
    # the part that is at work on n2, when it has finished one recording and not all
    until_ 60 part_on_n2 || :
    part_on_n2 || part=none
    until_ 120 in_the_middle || :
    kill_node n2
    finished >before.txt
    check "Slurm array: a node is killed in the middle of part $part" test "$(wc -l <before.txt)" -gt 0 -a "$(wc -l <before.txt)" -lt "$all"
    note "finished before the kill: $(wc -l <before.txt) of $all"
    check 'Slurm array: it comes to its end' until_ 900 no_jobs
    check 'Slurm array: the part that was lost was started again on the other node' test "$(grep -c ' to run, ' "results/.slurm/part-$part.txt")" -eq 2
    check 'Slurm array: nothing that was finished was done again' kept before.txt
    agrees 'Slurm array'
    note "Slurm array: $(since "$start")"

    finished >before.txt
    start_node n2
    check 'Slurm: the node is back' until_ 60 idle_nodes 2
    start=$(date +%s)
    # shellcheck disable=SC2086 # options
    "$here/slurm-array.sh" recordings results 4 $OPTIONS >>log.txt
    until_ 300 no_jobs || :
    check 'Slurm array, started again: nothing is done again' kept before.txt
    agrees 'Slurm array, started again'
    note "Slurm array, started again: $(since "$start")"
}

by_snakemake() {
    way c
    start=$(date +%s)
    # a group of its own, so that it can be killed with all it has started
    launch='exec setsid'
    snakemake_ --workflow-profile "$here/profiles/local" >log.txt 2>&1 &
    snakemake_group=$!
    launch=
    until_ 120 more_than 2 || :
    kill -9 "-$snakemake_group"
    wait "$snakemake_group" 2>/dev/null || :
    snakemake_group=
    sleep 0.5
    finished >before.txt
    check 'Snakemake: it is killed in the middle' test "$(wc -l <before.txt)" -gt 0 -a "$(wc -l <before.txt)" -lt "$all"
    snakemake_ --unlock >>log.txt 2>&1
    check 'Snakemake: started again it comes to its end' snakemake_ --workflow-profile "$here/profiles/local"
    check 'Snakemake: nothing that was finished was done again' kept before.txt
    agrees Snakemake
    note "Snakemake: $(since "$start")"
    finished >before.txt
    stamp=$(stat -c %Y results/summary.csv)
    check 'Snakemake, started again: nothing is left to be done' snakemake_ --workflow-profile "$here/profiles/local"
    check 'Snakemake, started again: nothing is touched' test "$(stat -c %Y results/summary.csv)" = "$stamp" -a "$(finished)" = "$(cat before.txt)"
}

by_snakemake_over_slurm() {
    way d
    start=$(date +%s)
    # a job that is killed with its node's other processes, and submitted again
    {
        until_ 200 more_than 1 && job=$(squeue -h -t R -o %A | head -n 1) && scancel --signal=KILL --full "$job"
        finished >before.txt
    } &
    killer=$!
    code=0
    snakemake_ --workflow-profile "$here/profiles/slurm" --slurm-status-command squeue --slurm-no-account \
        --slurm-init-seconds-before-status-checks 5 --latency-wait 10 >log.txt 2>&1 || code=$?
    wait "$killer" || :
    check 'Snakemake over Slurm: it comes to its end' test "$code" -eq 0
    check 'Snakemake over Slurm: a job was killed in the middle, and started again' grep -q 'Trying to restart' log.txt
    check 'Snakemake over Slurm: nothing that was finished was done again' kept before.txt
    agrees 'Snakemake over Slurm'
    note "Snakemake over Slurm: $(since "$start")"
}

rm -f "$work/checks.txt"
if [ ! -x "$work/venv/bin/snakemake" ]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet --requirement "$here/requirements.txt"
fi
rm -rf "$work/recordings"
"$here/test-recordings.sh" "$work/recordings"

by_batch
start_slurm
check 'Slurm: two nodes are up' until_ 30 idle_nodes 2
[ "$failures" -eq 0 ] || exit 1
for way in ${WAYS:-by_slurm_array by_snakemake by_snakemake_over_slurm}; do
    "$way"
done
note "all of it: $(since "$began"); what the checks said: $work/checks.txt"
[ "$failures" -eq 0 ]
