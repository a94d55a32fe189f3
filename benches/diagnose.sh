#!/usr/bin/env bash
# A diagnosis of a minute of two angles at 30 Hz, by what is missing; then with 500 bootstraps, and a strip. Wall-clock seconds, in turn.
#
#   benches/diagnose.sh [ROUNDS]        3 by default
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=${1:-3}
mkdir -p "${CARGO_TARGET_DIR:-target}/bench-diagnose"
data=$(realpath "${CARGO_TARGET_DIR:-target}/bench-diagnose")
freeswing=$(realpath "${CARGO_TARGET_DIR:-target}")/release/freeswing
cargo build --release --quiet

# name, then lines of [model.effects] that the recording has and the model does not know
recording() {
    name=$1
    shift
    cat >"$data/$name.base.toml" <<TOML
[specimen]
mass_kg = 0.4e-3
length_m = 0.20
link_lengths_m = [0.10, 0.10]
[model]
k_eq_n_m_per_rad = 2.0e-4
c_eq_n_m_s_per_rad = 5.0e-7
release_rad = [0.5, 0.62]
[model.effects]
TOML
    if [ "$name" = strip ]; then
        echo 'distributed_flexibility = 2.0e-5' >>"$data/$name.base.toml"
    fi
    { cat "$data/$name.base.toml"; printf '%s\n' "$@"; } >"$data/$name.toml"
    "$freeswing" simulate --config "$data/$name.toml" --out "$data/$name.csv" --duration 60 --rate 30 --noise-rad 1e-3
}
recording nothing
recording drag 'air_quadratic = 3e-4'
recording friction 'hinge_coulomb = 3e-7'
recording both 'hinge_coulomb = 1e-7' 'air_quadratic = 2e-4'
recording strip 'air_quadratic = 3e-4'

seconds() {
    name=$1
    shift
    local TIMEFORMAT=%R
    { time "$freeswing" diagnose --quiet "$data/$name.csv" --config "$data/$name.base.toml" --json "$data/$name.json" "$@" >/dev/null; } 2>&1
}
for ((round = 1; round <= rounds; round++)); do
    for name in nothing drag friction both strip; do
        printf '%s %s s, ' "$name" "$(seconds "$name")"
    done
    printf 'both with 500 bootstraps %s s\n' "$(seconds both --bootstraps 500)"
done
