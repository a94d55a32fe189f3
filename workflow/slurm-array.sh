#!/bin/sh
# A folder of recordings as a Slurm array: N parts beside each other, then a job that sums up. Needs nothing but Slurm and freeswing.
#
#     workflow/slurm-array.sh RECORDINGS RESULTS N [OPTION OF freeswing batch]...
#
# Start it again after whatever happened: what is finished is not done again. Both folders must be on a file system that all nodes share.
# From the environment: CORES a part (1), FREESWING, the program (freeswing), BEFORE, what a shell must do first ("module load freeswing").
# Partition, account, time limit and the like are sbatch's own: SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT, …
set -eu

# The jobs are this script as well: Slurm hands it on as it is now.
job() {
    what=$1 recordings=$2 results=$3 parts=$4
    shift 4
    [ "$what" = summary ] || set -- "$@" --shard "$SLURM_ARRAY_TASK_ID/$parts"
    eval "${BEFORE:-:}"
    code=0
    "${FREESWING:-freeswing}" batch "$recordings" --out "$results" --jobs "${SLURM_CPUS_PER_TASK:-1}" "$@" || code=$?
    # 1: some recordings failed, and their rows say why; that is no failure of the job
    [ "$code" -eq 1 ] || exit "$code"
    exit 0
}

case ${1-} in
    --part) shift; job part "$@" ;;
    --summary) shift; job summary "$@" ;;
esac

[ "$#" -ge 3 ] || { sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
recordings=$1 results=$2 parts=$3
shift 3
case $parts in
    '' | *[!0-9]* | 0*) echo "slurm-array: N must be a whole number from 1, and is $parts" >&2; exit 2 ;;
esac
[ -d "$recordings" ] || { echo "slurm-array: $recordings: no such folder" >&2; exit 2; }
logs=$results/.slurm
mkdir -p "$logs"

submit() {
    sbatch --parsable --cpus-per-task="${CORES:-1}" --open-mode=append --requeue "$@"
}
array=$(submit --job-name=freeswing --array="1-$parts" --output="$logs/part-%a.txt" \
    "$0" --part "$recordings" "$results" "$parts" "$@")
# a cluster's name may follow the number
array=${array%%;*}
# after all parts, however they ended: it runs what they have left
summary=$(submit --job-name=freeswing-summary --dependency="afterany:$array" --output="$logs/summary.txt" \
    "$0" --summary "$recordings" "$results" "$parts" "$@")
echo "submitted: $parts parts as job $array, the summary as job ${summary%%;*}; their logs: $logs"
